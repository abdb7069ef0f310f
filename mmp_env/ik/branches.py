"""All configurations of one arm for a tool pose."""

from __future__ import annotations

import functools

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, refused, whole
from mmp_env.errors import MmpError
from mmp_env.ik.chain import ArmModel, ToolModel, chain_of
from mmp_env.ik.freedom import FREE, Free
from mmp_env.ik.pose_solver import PoseSolver
from mmp_env.ik.turns import JointBox

_ROTATION_ERROR = 1e-6
"""Largest error of a rotation matrix."""


def branches(
    robot: ArmModel,
    tool: ToolModel | None,
    pose: ArrayLike,
    free: Free | None = None,
    limit: int = 1024,
    near: ArrayLike | None = None,
) -> Float[np.ndarray, "n dof"]:
    """Returns the configurations within the joint limits that bring the tool frame to a pose, the nearest first.

    Each is exact to 1e-6 m and 1e-6 rad. Hinges whose limits allow several turns appear with each of them. The result
    is the same on every machine but for rounding.

    Args:
        robot: the robot, such as an `mmp_env.Robot`.
        tool: its tool, or None.
        pose: of the tool frame [4, 4] in the base frame of the arm; without a tool, of the flange.
        free: rotation that may be any: None, `"z"` for that about the z axis of the tool, or `"rotation"`.
        limit: largest number of configurations; the nearest to `near` remain.
        near: configuration [rad or m] from which distance is counted, as the sum over the joints; None for home.

    Returns:
        Configurations [n, dof] [rad or m]; none where the arm does not reach the pose.

    Raises:
        MmpError: for a pose that is no rigid transform, an unknown `free`, a `limit` below 1, or a `near` of another
            number of joints.
    """
    goal, center = _checked_pose(pose), _checked_near(robot, near)
    if free is not None and free not in FREE:
        raise refused("free", free, f"None, {' or '.join(map(repr, FREE))}")
    limit = whole("limit", limit, 1)
    solver = _solver(robot, tool)
    return solver.box.with_turns(solver.solve(goal, free), center, limit)


@functools.lru_cache(maxsize=64)
def _solver(robot: ArmModel, tool: ToolModel | None) -> PoseSolver:
    box = JointBox(lower=robot.lower, upper=robot.upper, hinges=~np.array(robot.slides))
    return PoseSolver(chain_of(robot, tool), box)


def _checked_pose(pose: ArrayLike) -> Float[np.ndarray, "4 4"]:
    out = as_numbers(pose)
    if out is None or out.shape != (4, 4) or not np.isfinite(out).all():
        raise refused("the pose", pose, "a matrix of 4 x 4 finite numbers")
    turn = out[:3, :3]
    wrong = np.abs(turn @ turn.T - np.eye(3)).max() > _ROTATION_ERROR or np.linalg.det(turn) < 0
    if wrong or np.abs(out[3] - [0.0, 0.0, 0.0, 1.0]).max() > _ROTATION_ERROR:
        raise MmpError("the pose is no rigid transform: a rotation matrix and a position above the row [0, 0, 0, 1]")
    return out


def _checked_near(robot: ArmModel, near: ArrayLike | None) -> Float[np.ndarray, "dof"]:
    if near is None:
        return robot.home
    out = as_numbers(near)
    if out is None or out.shape != robot.lower.shape or not np.isfinite(out).all():
        raise refused("near", near, f"{len(robot.lower)} finite numbers, one a joint")
    return out
