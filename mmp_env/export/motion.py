"""The exported motion: times and joint positions of one plan, or of several in a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.export.joint_names import joint_names
from mmp_env.model.plan import Plan
from mmp_env.wording import counted, in_seconds

SAME = 1e-6
"""Largest distance [rad or m] of a joint between the end of a plan and the begin of the next."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmMotion:
    """The motion of one arm: names of its joints, and a row for each time; derivatives of retimed plans only."""

    joints: tuple[str, ...]
    positions: Float[np.ndarray, "t dof"]
    velocities: Float[np.ndarray, "t dof"] | None
    accelerations: Float[np.ndarray, "t dof"] | None

    @brief
    def __repr__(self) -> str:
        return f"of {counted(len(self.joints), 'joint')}: {counted(len(self.positions), 'sample')}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """The motion of all arms.

    Attributes:
        times: [t] [s], from 0.
        arms: arm name -> its motion at the times, linear in between.
    """

    times: Float[np.ndarray, "t"]
    arms: dict[str, ArmMotion]

    @brief
    def __repr__(self) -> str:
        joints, samples = counted(len(self.joints), "joint"), counted(len(self.times), "sample")
        return f"of {joints}: {samples}, {in_seconds(float(self.times[-1]))}"

    def only(self, arm: str) -> Motion:
        """Returns the motion of one arm."""
        return replace(self, arms={arm: self.arms[arm]})

    @property
    def joints(self) -> list[str]:
        """Names of all joints, arm after arm."""
        return [name for arm in self.arms.values() for name in arm.joints]

    def joined(self, key: str) -> Float[np.ndarray, "t n"] | None:
        """Returns `positions`, `velocities` or `accelerations` of all joints, arm after arm; None without them."""
        parts = [getattr(arm, key) for arm in self.arms.values()]
        return None if any(part is None for part in parts) else np.concatenate(parts, axis=1)


def motion_of(plans: Sequence[Plan], pattern: str) -> Motion:
    """Returns the motion of plans in a row, without a pause between them.

    Raises `MmpError` for no plan, a plan without an arm, a plan that does not begin at the end of the one before, and
    if only some are retimed.
    """
    if not plans:
        raise MmpError("there is no plan to export")
    for plan in plans:
        plan.check_complete()
    first = plans[0]
    for number, (before, after) in enumerate(pairwise(plans), start=1):
        _check_joint(before, after, number)
    starts = np.cumsum([0.0, *(plan.makespan_s for plan in plans[:-1])])
    names = joint_names(first.problem.cell, pattern)
    # The row where two plans meet is that of the earlier plan.
    times = np.concatenate(
        [plan.times[k > 0 :] + start for k, (plan, start) in enumerate(zip(plans, starts, strict=True))]
    )
    arms = {
        arm: ArmMotion(
            joints=names[arm],
            positions=_rows(plans, "positions", arm),
            velocities=_rows(plans, "velocities", arm) if first.velocities is not None else None,
            accelerations=_rows(plans, "accelerations", arm) if first.accelerations is not None else None,
        )
        for arm in first.problem.cell.arm_names
    }
    return Motion(times=times, arms=arms)


def _rows(plans: Sequence[Plan], key: str, arm: str) -> Float[np.ndarray, "t dof"]:
    return np.concatenate([getattr(plan, key)[arm][k > 0 :] for k, plan in enumerate(plans)])


def _check_joint(before: Plan, after: Plan, number: int) -> None:
    """Raises `MmpError` if plan `number`, counted from 0, cannot follow the one before it."""
    between = f"plan {number} does not go on from plan {number - 1}"
    one, other = ([(arm.name, arm.robot.name) for arm in plan.problem.cell.arms] for plan in (before, after))
    if one != other:
        raise MmpError(f"{between}: its arms are others")
    for key in ("velocities", "accelerations"):
        if (getattr(before, key) is None) != (getattr(after, key) is None):
            raise MmpError(f"{between}: only one of them has {key}; retime both or neither")
    for arm, q in after.positions.items():
        gaps = np.abs(q[0] - before.positions[arm][-1])
        k = int(np.argmax(gaps))
        if not gaps[k] <= SAME:
            unit = after.problem.cell.arm(arm).robot.units[k]
            raise MmpError(f"{between}: arm '{arm}' begins {gaps[k]:.3g} {unit} from where it ended")
