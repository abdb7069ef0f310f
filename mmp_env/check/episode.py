"""The checker of episodes: every plan is valid, and each begins where the one before it ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check import check_document
from mmp_env.check.checked import CheckedArm, CheckedPlan
from mmp_env.check.fields import UnreadableError, known, listed, member, rotation, shown
from mmp_env.check.reading import read_plan
from mmp_env.check.report import CheckReport, Violation, in_short
from mmp_env.check.rules import END_TOLERANCE

SCHEMA = "mmp-episode/1"
SAME_PLACE = 1e-9
"""Largest difference between the positions [m] and rotation matrices of a base in two plans."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeReport:
    """A report for each plan, and the violations between plans or of the whole. It is true if all are valid.

    Attributes:
        plans: the reports of the plans, in their order.
        violations: faults between two plans, or of the file.
    """

    plans: tuple[CheckReport, ...] = ()
    violations: tuple[Violation, ...] = ()

    @property
    def valid(self) -> bool:
        """Whether every plan is valid and they fit together; also what the report is as a truth value."""
        return not self.violations and all(plan.valid for plan in self.plans)

    def __bool__(self) -> bool:
        return self.valid

    @property
    def sentences(self) -> list[str]:
        """A sentence for every violation; plans are numbered from 0, as in the file."""
        inside = [f"plan {k}: {sentence}" for k, plan in enumerate(self.plans) for sentence in plan.sentences]
        return [*inside, *map(str, self.violations)]

    @property
    def min_clearance_m(self) -> float | None:
        """The least clearance [m] proved of any plan; None if a proof failed."""
        proved = [plan.min_clearance_m for plan in self.plans]
        return min((p for p in proved if p is not None), default=None) if None not in proved else None

    def as_dict(self) -> dict[str, Any]:
        """Returns the report as JSON values."""
        return {
            "valid": self.valid,
            "violations": [violation.as_dict() for violation in self.violations],
            "min_clearance_m": self.min_clearance_m,
            "plans": [plan.as_dict() for plan in self.plans],
        }

    def __repr__(self) -> str:
        return f"<EpisodeReport of {len(self.plans)} plans: {'valid' if self.valid else in_short(self.sentences)}>"

    def __str__(self) -> str:
        if not self.valid:
            return "\n".join(self.sentences)
        return "\n".join(f"plan {k}: {plan}" for k, plan in enumerate(self.plans))


def check_episode(data: Any, *, exact: bool = False) -> EpisodeReport:
    """Checks the content of an episode file: every plan, and that each begins where the one before it ends.

    Args:
        data: content of an episode file, schema `mmp-episode/1`.
        exact: as in `check_document`.

    Returns:
        A report for the episode. Nothing in the data raises.
    """
    try:
        if member(data, "schema", "the episode") != SCHEMA:
            raise UnreadableError(f"schema is {shown(data['schema'])}; this checker reads '{SCHEMA}'")
        known(data, ("schema", "name", "plans"), "the episode")
        documents = listed(data, "plans", "the episode")
        for k, document in enumerate(documents):
            member(document, "schema", f"plan {k}")
        if not documents:
            raise UnreadableError("the episode has no plans")
    except UnreadableError as error:
        return EpisodeReport(violations=(error.violation,))
    reports = tuple(check_document(document, exact=exact) for document in documents)
    seams = [v for k, pair in enumerate(pairwise(documents)) for v in _seam(k, pair)]
    return EpisodeReport(plans=reports, violations=tuple(seams))


def _seam(number: int, pair: tuple[Mapping[str, Any], Mapping[str, Any]]) -> Iterator[Violation]:
    """Yields the faults between plan `number` and the next; none if one cannot be read, which its own report says."""
    try:
        before, after = map(read_plan, pair)
    except UnreadableError:
        return
    between = f"plan {number + 1} does not go on from plan {number}"
    if not _same_arms(before, after):
        yield Violation(rule="schema", message=f"{between}: its arms are others, or stand elsewhere")
        return
    off = np.abs(after.positions[0] - before.positions[-1])
    for column in np.flatnonzero(~(off <= END_TOLERANCE)):
        (arm, joint), unit = after.joints[column], after.units[column]
        yield Violation(
            rule="start",
            message=f"{between}: arm '{arm}', joint {joint}, begins {off[column]:.3g} {unit} from where it ended",
            arms=(arm,),
            values={"joint": joint, f"off_{unit}": float(off[column])},
        )


def _same_arms(before: CheckedPlan, after: CheckedPlan) -> bool:
    """Returns whether two plans have the same arms with the same tools at the same places."""
    one, other = (
        [(arm.name, arm.robot.content, arm.tool and arm.tool.content) for arm in plan.cell.arms]
        for plan in (before, after)
    )
    bases = zip(before.cell.arms, after.cell.arms, strict=False)
    return one == other and all(np.abs(_place(base) - _place(moved)).max() <= SAME_PLACE for base, moved in bases)


def _place(arm: CheckedArm) -> Float[np.ndarray, "3 4"]:
    return np.column_stack([rotation(arm.quaternion), arm.position])
