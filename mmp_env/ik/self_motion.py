"""Self-motions of redundant arms: the curves of configurations that all have the tool at its pose."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.ik.tool_task import ToolTask
from mmp_env.ik.turns import JointBox


def on_curves(
    task: ToolTask, box: JointBox, q: Float[np.ndarray, "n dof"], pose: Float[np.ndarray, "4 4"], *, step: float
) -> Float[np.ndarray, "m dof"]:
    """Returns configurations within the joint limits on the curves through others, without gaps.

    Each curve is followed until it closes, also beyond the limits of hinges, where it may return.

    Args:
        task: the arm, which has one joint more than the task has equations.
        box: the joint limits.
        q: configurations with the tool at its pose, within the limits or not.
        pose: of the tool frame in the base frame.
        step: largest distance of neighbours on a curve [rad or m], over all joints together.
    """
    return core.self_motions(
        **task.chain.numbers,
        rows=task.rows,
        q=np.ascontiguousarray(q),
        pose=np.ascontiguousarray(pose),
        lower=box.lower,
        upper=box.upper,
        step=step,
    )
