"""What is exported: times and joint motions of one plan, or of several that follow one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.export.joint_names import joint_names
from mmp_env.model.plan import Plan

SAME_RAD = 1e-6
"""A plan begins where the one before it ends, up to this."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmMotion:
    """One arm: names of its joints, and rows for the times of the motion; only a retimed plan has derivatives."""

    joints: tuple[str, ...]
    positions: Float[np.ndarray, "t dof"]
    velocities: Float[np.ndarray, "t dof"] | None
    accelerations: Float[np.ndarray, "t dof"] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """`times` [t] [s] from 0, and the motion of each arm on it, linear between the times."""

    times: Float[np.ndarray, "t"]
    arms: dict[str, ArmMotion]

    def only(self, arm: str) -> Motion:
        return replace(self, arms={arm: self.arms[arm]})

    @property
    def joints(self) -> list[str]:
        """Names of all joints, arm after arm."""
        return [name for arm in self.arms.values() for name in arm.joints]

    def joined(self, key: str) -> Float[np.ndarray, "t n"] | None:
        """`positions`, `velocities` or `accelerations` of all joints, arm after arm; None where there are none."""
        parts = [getattr(arm, key) for arm in self.arms.values()]
        return None if any(part is None for part in parts) else np.concatenate(parts, axis=1)


def motion_of(plans: Sequence[Plan], pattern: str) -> Motion:
    """The motion of plans one after another; between two of them the arms stand still for no time at all.

    Raises `MmpError` where one does not begin where the one before it ends, or is retimed and another is not; for plans
    that lack an arm, and for none.
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
    # Where two plans meet there is one row, the earlier plan's.
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
    """Raises `MmpError` where plan `number`, counted from 0, cannot follow the one before it."""
    between = f"plan {number} does not go on from plan {number - 1}"
    one, other = ([(arm.name, arm.robot.name) for arm in plan.problem.cell.arms] for plan in (before, after))
    if one != other:
        raise MmpError(f"{between}: its arms are others")
    for key in ("velocities", "accelerations"):
        if (getattr(before, key) is None) != (getattr(after, key) is None):
            raise MmpError(f"{between}: only one of them has {key}; retime both or neither")
    for arm, q in after.positions.items():
        gap = float(np.abs(q[0] - before.positions[arm][-1]).max())
        if not gap <= SAME_RAD:
            raise MmpError(f"{between}: arm '{arm}' begins {gap:.3g} rad from where it ended")
