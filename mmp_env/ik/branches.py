"""All configurations of one arm for a tool pose."""

from __future__ import annotations

import functools

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, refused, whole
from mmp_env.errors import MmpError
from mmp_env.ik.chain import ArmModel, ToolModel, chain_of
from mmp_env.ik.freedom import FREE, Free
from mmp_env.ik.pose_solver import PoseSolver
from mmp_env.ik.turns import JointBox

_ROTATION_ERROR = 1e-6
"""Largest error of a rotation matrix."""
_MOST_KNOWN = 1024
"""Number of poses whose configurations are kept."""


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
    center = _checked_near(robot, near)
    limit = whole("limit", limit, 1)
    solver, found = _solved(robot, tool, pose, free)
    return solver.box.with_turns(found, center, limit)[0]


def branches_by_posture(
    robot: ArmModel, tool: ToolModel | None, pose: ArrayLike, free: Free | None, limit: int, near: ArrayLike
) -> tuple[Float[np.ndarray, "n dof"], Int[np.ndarray, "n"]]:
    """Returns the `limit` nearest branches and the nearest of every posture, in order of distance, and their postures.

    A posture is a number; configurations of one posture differ by whole turns of hinges alone. The arguments are those
    of `branches`.
    """
    center = _checked_near(robot, near)
    solver, found = _solved(robot, tool, pose, free)
    rows, postures = solver.box.with_turns(found, center, limit)
    absent = np.ones(len(found), dtype=bool)
    absent[postures] = False
    if not absent.any():
        return rows, postures
    missing = np.flatnonzero(absent)
    far = solver.box.nearest_turns(found[missing], center)
    order = np.abs(far - center).sum(axis=1).argsort(kind="stable")
    return np.concatenate([rows, far[order]]), np.concatenate([postures, missing[order]])


def nearest_beyond_limits(
    robot: ArmModel, tool: ToolModel | None, pose: ArrayLike, free: Free | None
) -> Float[np.ndarray, "dof"] | None:
    """Returns the configuration that leaves the joint limits of hinges least of those for a pose, or None.

    The arguments are those of `branches`. It counts the sum over the joints.
    """
    solver = _solver(robot, tool)
    found = PoseSolver(chain_of(robot, tool), solver.box.unlimited()).solve(_checked_pose(pose), free)
    if not len(found):
        return None
    beyond = solver.box.least_beyond(found)
    return beyond[np.maximum(robot.lower - beyond, beyond - robot.upper).clip(0).sum(axis=1).argmin()]


def _solved(
    robot: ArmModel, tool: ToolModel | None, pose: ArrayLike, free: Free | None
) -> tuple[PoseSolver, Float[np.ndarray, "n dof"]]:
    """Returns the solver of an arm, and one configuration of every posture."""
    goal = _checked_pose(pose)
    if free is not None and free not in FREE:
        raise refused("free", free, f"None, {' or '.join(map(repr, FREE))}")
    return _solver(robot, tool), _solutions(robot, tool, np.array(goal, dtype=float).tobytes(), free)


@functools.lru_cache(maxsize=_MOST_KNOWN)
def _solutions(robot: ArmModel, tool: ToolModel | None, pose: bytes, free: Free | None) -> Float[np.ndarray, "n dof"]:
    """Returns one configuration of every posture, read-only. `pose`: the bytes of a matrix of 4 x 4 numbers."""
    out = _solver(robot, tool).solve(np.frombuffer(pose).reshape(4, 4), free)
    out.setflags(write=False)
    return out


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
