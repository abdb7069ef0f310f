"""The checker of episodes: every plan is valid, and each begins where the one before it ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mmp_env.check import check_plan
from mmp_env.check.fields import UnreadableError, known, listed, member
from mmp_env.check.reading import PlanData, read_plan
from mmp_env.check.report import CheckReport, Violation
from mmp_env.check.rules import END_TOLERANCE_RAD

SCHEMA = "mmp-episode/1"


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeReport:
    """A report for each plan, and what is wrong between them or with the whole."""

    plans: tuple[CheckReport, ...] = ()
    violations: tuple[Violation, ...] = ()

    @property
    def valid(self) -> bool:
        return not self.violations and all(plan.valid for plan in self.plans)

    @property
    def min_clearance_m(self) -> float | None:
        """The least that was proved [m]; None where a proof failed."""
        proved = [plan.min_clearance_m for plan in self.plans]
        return min((p for p in proved if p is not None), default=None) if None not in proved else None

    def as_dict(self) -> dict[str, Any]:
        """The report as JSON values."""
        return {
            "valid": self.valid,
            "violations": [violation.as_dict() for violation in self.violations],
            "min_clearance_m": self.min_clearance_m,
            "plans": [plan.as_dict() for plan in self.plans],
        }

    def __str__(self) -> str:
        lines = [f"plan {k}: {plan}" for k, plan in enumerate(self.plans)]
        return "\n".join([*lines, *map(str, self.violations)])


def check_episode(data: Any, *, exact: bool = False) -> EpisodeReport:
    """Checks the content of an episode file; never raises for what is wrong with it. `exact` as in `check_plan`."""
    try:
        if member(data, "schema", "the episode") != SCHEMA:
            raise UnreadableError(f"schema is {data['schema']!r}; this checker reads '{SCHEMA}'")
        known(data, ("schema", "name", "plans"), "the episode")
        documents = listed(data, "plans", "the episode")
        for k, document in enumerate(documents):
            member(document, "schema", f"plan {k}")
        if not documents:
            raise UnreadableError("the episode has no plans")
    except UnreadableError as error:
        return EpisodeReport(violations=(error.violation,))
    reports = tuple(check_plan(document, exact=exact) for document in documents)
    seams = [v for k, pair in enumerate(pairwise(documents)) for v in _seam(k, pair)]
    return EpisodeReport(plans=reports, violations=tuple(seams))


def _seam(number: int, pair: tuple[Mapping[str, Any], Mapping[str, Any]]) -> Iterator[Violation]:
    """What does not fit between plan `number` and the next; nothing where one cannot be read, which its report says."""
    try:
        before, after = map(read_plan, pair)
    except UnreadableError:
        return
    between = f"plan {number + 1} does not go on from plan {number}"
    if _arms(before) != _arms(after):
        yield Violation(rule="schema", message=f"{between}: its arms are others, or stand elsewhere")
        return
    off = np.abs(after.positions[0] - before.positions[-1])
    for column in np.flatnonzero(~(off <= END_TOLERANCE_RAD)):
        arm, joint = after.joints[column]
        yield Violation(
            rule="start",
            message=f"{between}: arm '{arm}', joint {joint}, begins {off[column]:.3g} rad from where it ended",
            arms=(arm,),
            values={"joint": joint, "off_rad": float(off[column])},
        )


def _arms(plan: PlanData) -> list[tuple]:
    return [(a.name, a.model, a.tool, *a.position.tolist(), *a.quaternion.tolist()) for a in plan.cell.arms]
