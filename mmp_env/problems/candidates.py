"""Candidates for the goal of one arm: the configurations of what was asked for, within limits and free alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env import core
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.ik import branches_by_posture, nearest_beyond_limits
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.collision import levels_of
from mmp_env.model.goals import Goal, JointGoal, NamedGoal, PoseGoal, Stay, flat
from mmp_env.model.keep import Upright
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.transforms import matrix_from_quaternion, transform
from mmp_env.wording import counted, how_far_apart

MOST_CANDIDATES = 64
"""Largest number of candidates of an arm."""
_SAME = 1e-4
"""Largest difference of sines and cosines, or of slides [m], of two configurations of one posture."""
_ROOM_M = 3e-5
"""Clearance [m] beyond the margin that a candidate has."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidates:
    """Configurations for the goal of one arm, the nearest to its start first.

    Attributes:
        q: configurations [rad or m].
        posture: number of the posture of each. Configurations of one posture differ by whole turns of hinges alone.
    """

    q: Float[np.ndarray, "n dof"]
    posture: Int[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.q)

    def take(self, rows: Int[np.ndarray, "m"] | Bool[np.ndarray, "n"]) -> Candidates:
        """Returns some of the candidates."""
        return Candidates(q=self.q[rows], posture=self.posture[rows])

    @cached_property
    def nearest_of_postures(self) -> Int[np.ndarray, "m"]:
        """Index of the nearest candidate of each posture, ascending."""
        return np.sort(np.unique(self.posture, return_index=True)[1])


def candidates(arm: Arm, goal: Goal, near: Float[np.ndarray, "dof"], where: str) -> Candidates:
    """Returns the configurations of a goal, the nearest to `near` first (L1).

    Each is within the joint limits, but for a single configuration that was given. At most `MOST_CANDIDATES` are
    returned: the nearest of each posture, and then the nearest of the others. If there are too many postures, we take
    the nearest half and postures that are evenly spread over the others.

    Args:
        arm: the arm.
        goal: what was asked for.
        near: the start of the arm, or for a start its home configuration.
        where: begin of the messages, such as `goal of arm 'left'`.

    Raises:
        InvalidInstanceError: if the arm cannot reach any of the poses.
    """
    goals = flat(goal)
    found = [_configurations(arm, each, near, where) for each in goals]
    if len(found) == 1:
        every = found[0]
    else:
        rows = np.concatenate([each.q for each in found])
        rows = rows[np.abs(rows - near).sum(axis=1).argsort(kind="stable")]
        every = Candidates(q=rows, posture=_postures(arm, rows))
        every = every.take(np.flatnonzero(((arm.robot.lower <= rows) & (rows <= arm.robot.upper)).all(axis=1)))
    if not len(every):
        raise InvalidInstanceError(_unreachable(arm, goals, where))
    return _at_most(every, MOST_CANDIDATES)


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


def what_blocks(cell: Cell, arm: Arm, q: Float[np.ndarray, "n dof"], margins: Margins) -> str:
    """Returns words for what is too near to an arm that is alone in the cell, in the best of its configurations."""
    clearances = cell.collision.static_clearance(arm.name, q, precise=True)
    best = int(np.argmax(clearances))
    near = cell.alone(arm.name).collision.nearest({arm.name: q[best]})
    worst = near[min(("obstacles", "self"), key=lambda kind: near[kind].clearance_m - margins[kind])]
    alone = float(clearances[best])
    if min(near[kind].clearance_m for kind in KINDS) > alone + 1e-6:  # the base of another arm is nearer
        return f"the base of another arm, {how_far_apart(alone)}"
    return f"{worst.bodies}, {how_far_apart(worst.clearance_m)}"


def _configurations(
    arm: Arm, goal: JointGoal | PoseGoal | NamedGoal | Stay, near: Float[np.ndarray, "dof"], where: str
) -> Candidates:
    match goal:
        case JointGoal():
            if goal.q.shape != (arm.dof,):
                raise wrong_shape(arm, goal, where)
            return _one(goal.q)
        case NamedGoal():
            return _one(arm.robot.home if goal.name == "home" else arm.robot.tucked)
        case Stay():
            return _one(near)
        case PoseGoal():
            rows, postures = branches_by_posture(
                arm.robot, arm.tool, _in_base(arm, goal), goal.free, MOST_CANDIDATES, near
            )
            return Candidates(q=rows, posture=postures)


def _one(q: Float[np.ndarray, "dof"]) -> Candidates:
    return Candidates(q=q[None], posture=np.zeros(1, dtype=int))


def _in_base(arm: Arm, goal: PoseGoal) -> Float[np.ndarray, "4 4"]:
    turn = np.eye(3) if goal.quaternion is None else matrix_from_quaternion(goal.quaternion)
    return np.linalg.inv(arm.T_world_base) @ transform(turn, goal.position)


def _unreachable(arm: Arm, goals: Sequence[Goal], where: str) -> str:
    if len(goals) > 1:
        return f"{where}: none of the {len(goals)} poses can be reached within the joint limits"
    goal = goals[0]
    assert isinstance(goal, PoseGoal)
    at = f"[{', '.join(f'{x:.3f}' for x in goal.position)}]"
    beyond = nearest_beyond_limits(arm.robot, arm.tool, _in_base(arm, goal), goal.free)
    if beyond is None:
        away = float(np.linalg.norm(goal.position - arm.position))
        return (
            f"{where} is out of reach: {at} is {away:.2f} m from the base, and no configuration of a {arm.robot.name}"
            " brings the tool there"
        )
    robot = arm.robot
    k = int(np.maximum(robot.lower - beyond, beyond - robot.upper).argmax())
    return (
        f"{where} is outside the joint limits: to bring the tool to {at}, joint {k + 1} ({robot.joint_names[k]}) would"
        f" have to be {beyond[k]:.4f} {robot.units[k]}; allowed: {robot.lower[k]:.4f} to {robot.upper[k]:.4f}"
    )


def _postures(arm: Arm, q: Float[np.ndarray, "n dof"]) -> Int[np.ndarray, "n"]:
    slides = np.array(arm.robot.slides)
    without_turns = np.hstack([np.where(slides, q, np.cos(q)), np.where(slides, 0.0, np.sin(q))])
    return np.unique(np.round(without_turns / _SAME), axis=0, return_inverse=True)[1].reshape(-1)


def _at_most(every: Candidates, most: int) -> Candidates:
    if len(every) <= most:
        return every
    first = every.nearest_of_postures
    if len(first) > most:
        half = most // 2
        return every.take(np.concatenate([first[:half], first[np.linspace(half, len(first) - 1, half).astype(int)]]))
    again = np.ones(len(every), dtype=bool)
    again[first] = False
    return every.take(np.sort(np.concatenate([first, np.flatnonzero(again)[: most - len(first)]])))


def in_collision(where: str, count: int, why: str) -> InvalidInstanceError:
    """Returns the error that every configuration of a goal is in collision alone."""
    each = "the configuration is" if count == 1 else f"each of its {counted(count, 'configuration')} is"
    return InvalidInstanceError(f"{where}: {each} in collision or closer than a margin; the nearest: {why}")


def not_upright(where: str, tilt: float, bound: Upright) -> InvalidInstanceError:
    """Returns the error that a tool axis is `tilt` [rad] from the world's z axis, at least, and beyond its bound."""
    return InvalidInstanceError(
        f"{where}: its tool axis is {tilt:.4f} rad from the world's z axis, and its bound is {bound.within:g} rad"
    )
