"""Candidates for the goal of one arm: the configurations of what was asked for, within limits and free alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env import core
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.ik import branches
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.collision import levels_of
from mmp_env.model.goals import Goal, JointGoal, NamedGoal, PoseGoal, Stay, flat
from mmp_env.model.keep import Upright
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.transforms import matrix_from_quaternion, transform
from mmp_env.wording import counted

MOST_CANDIDATES = 64
"""Largest number of candidates of an arm."""
_SAME = 1e-4
"""Largest difference of sines and cosines, or of slides [m], of two configurations that are one place of the arm."""
_ROOM_M = 3e-5
"""Clearance [m] beyond the margin that a candidate has."""


def candidates(arm: Arm, goal: Goal, near: Float[np.ndarray, "dof"], where: str) -> Float[np.ndarray, "n dof"]:
    """Returns the configurations [n, dof] of a goal, the nearest to `near` first (L1).

    Each is within the joint limits, but for numbers that were given. Equal places of the arm that differ by turns of
    joints come after the nearest of them, and at most `MOST_CANDIDATES` are returned.

    Args:
        arm: the arm.
        goal: what was asked for.
        near: the start of the arm, or for a start its home configuration.
        where: begin of the messages, such as `goal of arm 'left'`.

    Raises:
        InvalidInstanceError: if the arm cannot reach any of the poses.
    """
    rows = [_configurations(arm, each, near, where) for each in flat(goal)]
    found = np.concatenate(rows)
    if not len(found):
        raise InvalidInstanceError(_unreachable(arm, flat(goal), where))
    return _spread(arm, found[np.argsort(np.abs(found - near).sum(axis=1), kind="stable")])


def wrong_shape(arm: Arm, goal: JointGoal, where: str) -> MmpError:
    """Returns the error that a configuration has the wrong number of joints."""
    return MmpError(f"{where} has shape {list(goal.q.shape)}; a {arm.robot.name} has {arm.dof} joints")


def are_free_alone(
    cell: Cell, arm: Arm, q: Float[np.ndarray, "n dof"], margins: Margins, room: float
) -> Bool[np.ndarray, "n"]:
    """Returns which configurations keep the margins and `room` [m] from obstacles, other bases and the arm itself.

    They also keep the bound of the tool axis, with that much room for the point at 1 m on the axis.
    """
    rows = np.ascontiguousarray(q)
    room += _ROOM_M
    free = cell.collision.within_limits(arm.name, rows)
    free[free] = core.edges_free(
        cell.collision.core, cell.arm_index(arm.name), rows[free], rows[free], levels_of(margins, room, room)
    )
    return free


def what_blocks(cell: Cell, arm: Arm, q: Float[np.ndarray, "n dof"]) -> str:
    """Returns words for what is nearest to the first of the configurations of an arm, were it alone in the cell."""
    others = {other.name: other.robot.home for other in cell.arms}
    near = cell.collision.nearest({**others, arm.name: q[0]})
    worst = min((near[kind] for kind in KINDS if kind != "arms"), key=lambda each: each.clearance_m)
    alone = float(cell.collision.static_clearance(arm.name, q[:1], precise=True)[0])
    if worst.clearance_m > alone + 1e-6:  # the base of another arm is nearer
        return f"the base of another arm, {alone * 1e3:.1f} mm away"
    return f"{worst.bodies}, {worst.clearance_m * 1e3:.1f} mm apart"


def _configurations(
    arm: Arm, goal: JointGoal | PoseGoal | NamedGoal | Stay, near: Float[np.ndarray, "dof"], where: str
) -> Float[np.ndarray, "n dof"]:
    match goal:
        case JointGoal():
            if goal.q.shape != (arm.dof,):
                raise wrong_shape(arm, goal, where)
            return goal.q[None]
        case NamedGoal():
            return (arm.robot.home if goal.name == "home" else arm.robot.tucked)[None]
        case Stay():
            return near[None]
        case PoseGoal():
            turn = np.eye(3) if goal.quaternion is None else matrix_from_quaternion(goal.quaternion)
            in_base = np.linalg.inv(arm.T_world_base) @ transform(turn, goal.position)
            return branches(arm.robot, arm.tool, in_base, goal.free, near=near)


def _unreachable(arm: Arm, goals: Sequence[Goal], where: str) -> str:
    if len(goals) > 1:
        return f"{where}: none of the {len(goals)} poses can be reached within the joint limits"
    goal = goals[0]
    assert isinstance(goal, PoseGoal)
    at = ", ".join(f"{x:.3f}" for x in goal.position)
    away = float(np.linalg.norm(goal.position - arm.position))
    return (
        f"{where} is out of reach: [{at}] is {away:.2f} m from the base, and no configuration of a {arm.robot.name}"
        " within its joint limits brings the tool there"
    )


def places(arm: Arm, q: Float[np.ndarray, "n dof"]) -> Int[np.ndarray, "m"]:
    """Returns the indices of the first row for each place of the arm, ascending: rows that differ by turns are one."""
    slides = np.array(arm.robot.slides)
    round_trip = np.hstack([np.where(slides, q, np.cos(q)), np.where(slides, 0.0, np.sin(q))])
    return np.sort(np.unique(np.round(round_trip / _SAME), axis=0, return_index=True)[1])


def _spread(arm: Arm, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "m dof"]:
    """Returns at most `MOST_CANDIDATES` of the sorted rows: of each place of the arm the nearest, then the others.

    Of too many places it takes the nearest half, and then places that are evenly spread over the others.
    """
    first = places(arm, q)
    if len(first) > MOST_CANDIDATES:
        half = MOST_CANDIDATES // 2
        chosen = np.concatenate([first[:half], first[np.linspace(half, len(first) - 1, half).astype(int)]])
    else:
        again = np.setdiff1d(np.arange(len(q)), first)
        chosen = np.sort(np.concatenate([first, again[: MOST_CANDIDATES - len(first)]]))
    return q[chosen]


def in_collision(where: str, count: int, why: str) -> InvalidInstanceError:
    """Returns the error that every configuration of a goal is in collision alone."""
    each = "the configuration is" if count == 1 else f"each of its {counted(count, 'configuration')} is"
    return InvalidInstanceError(f"{where}: {each} in collision or closer than a margin; the nearest: {why}")


def not_upright(where: str, tilt: float, bound: Upright) -> InvalidInstanceError:
    """Returns the error that a tool axis is `tilt` [rad] from the world's z axis, at least, and beyond its bound."""
    return InvalidInstanceError(
        f"{where}: its tool axis is {tilt:.4f} rad from the world's z axis, and its bound is {bound.within:g} rad"
    )
