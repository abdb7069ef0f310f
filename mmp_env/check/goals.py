"""The rule that each arm ends at something that was asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from mmp_env.check.asked import AskedPose
from mmp_env.check.checked import CheckedPlan
from mmp_env.check.model import CellModel
from mmp_env.check.report import Violation

POSE_TOLERANCE_M, POSE_TOLERANCE_RAD = 1e-4, 1e-4
"""Largest distance of the tool from a pose that was asked for, and largest angle."""
JOINT_TOLERANCE = 1e-6
"""Largest distance of a joint [rad or m] from a configuration that was asked for."""


def goals(plan: CheckedPlan, model: CellModel) -> Iterator[Violation]:
    """Yields a violation for each arm whose last configuration is nothing that was asked for."""
    if not plan.asked:
        return
    data = model.place(plan.positions[-1])
    ends = np.split(plan.positions[-1], np.cumsum([arm.dof for arm in plan.cell.arms])[:-1])
    for arm, end in zip(plan.cell.arms, ends, strict=True):
        frame = data.body(f"{arm.name}/{arm.tool.name}") if arm.tool else data.site(f"{arm.name}/flange")
        turn = frame.xmat.reshape(3, 3)
        off = [
            each.off(np.array(frame.xpos), turn) if isinstance(each, AskedPose) else _off(each, end)
            for each in plan.asked[arm.name]
        ]
        if any(metres <= POSE_TOLERANCE_M and angle <= POSE_TOLERANCE_RAD for metres, angle in off):
            continue
        metres, angle = min(off, key=sum)
        yield Violation(
            rule="goal",
            message=f"arm '{arm.name}' ends at nothing that was asked for; the nearest is {metres:.3g} m and"
            f" {angle:.3g} rad away",
            time_s=float(plan.times[-1]),
            arms=(arm.name,),
            values={"off_m": metres, "off_rad": angle},
        )


def _off(asked: Float[np.ndarray, "dof"], end: Float[np.ndarray, "dof"]) -> tuple[float, float]:
    """Returns 0 for a configuration that was asked for, and otherwise the largest error of a joint as an angle."""
    error = float(np.abs(end - asked).max())
    return 0.0, 0.0 if error <= JOINT_TOLERANCE else max(error, 2 * POSE_TOLERANCE_RAD)
