"""Straight lines of tools, such as the approach to a part and the retreat from it, as proved plans."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.argument_checks import as_numbers, known_keywords, number, refused
from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.ik.chain import SerialChain, chain_of
from mmp_env.ik.tool_line import FollowedLine, ToolLine, follow
from mmp_env.ik.turns import JointBox
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell, given_cell
from mmp_env.model.certificate import certify
from mmp_env.model.goals import GivenGoal, PoseGoal, as_goal
from mmp_env.model.keep import GivenKeep
from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem
from mmp_env.model.transforms import matrix_from_quaternion, transform
from mmp_env.problems.candidates import not_upright
from mmp_env.problems.making import make_problem
from mmp_env.wording import how_far_apart

FRAMES = ("world", "tool")
"""Frames in which a displacement of a tool is given."""
TOLERANCE = 1e-4
"""Distance of a tool from its line [m], and of its rotation [rad], by default."""
_HALF_TURN = 1e-3
"""Least angle [rad] to half a turn, about whose axis a tool could turn in two directions."""


@known_keywords
def straight_line(
    cell: Cell,
    start: Mapping[str, GivenGoal] | ArrayLike,
    *,
    to: Mapping[str, GivenGoal] | None = None,
    by: Mapping[str, ArrayLike] | None = None,
    frame: str = "world",
    tolerance: float = TOLERANCE,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float | Mapping[str, float] | Margins | None = None,
    name: str = "",
    keep: GivenKeep | None = None,
) -> Plan:
    """Returns a proved plan in which tools move along straight lines, all on one clock. Other arms stay at their start.

    A tool also turns evenly about one axis, where its pose at the end is turned. It is within the tolerance of this
    motion at every instant.

    Args:
        cell: arms and obstacles.
        start: for every arm of the cell, in the forms of `make_problem`; often the end of a plan.
        to: arm name -> pose of the tool frame in the world at the end: a `PoseGoal`, or its form of JSON. A tool whose
            rotation is free turns no more than it must.
        by: arm name -> displacement of the tool [3] [m]; it does not turn.
        frame: of the displacements: `world`, or `tool` for the tool frame at the start.
        tolerance: largest distance of a tool from its line [m], and of its rotation [rad].
        max_velocity: as for `make_problem`.
        margin: as for `make_problem`.
        name: of the instance.
        keep: as for `make_problem`.

    Raises:
        MmpError: for wrong arguments, a line of no arm, and two lines of one arm.
        InvalidInstanceError: if the start is not valid, or an arm cannot follow its line: a joint limit, the end of its
            reach, a singular configuration, or a body in its path.
    """
    given_cell(cell)
    tolerance = number("tolerance", tolerance, "a distance above 0 [m]")
    if frame not in FRAMES:
        raise UnknownNameError("frame", str(frame), FRAMES)
    asked = _asked(cell, to or {}, by or {})
    stay = dict.fromkeys(cell.arm_names, "stay")
    begin = make_problem(cell, start, stay, max_velocity=max_velocity, margin=margin, name=name, keep=keep)
    lines = {arm: _followed(begin, arm, goal, frame, tolerance) for arm, goal in asked.items()}
    end = {arm: lines[arm].q[-1] if arm in lines else begin.start[arm] for arm in cell.arm_names}
    problem = make_problem(
        begin.cell, begin.start, end, max_velocity=begin.max_velocity, margin=margin, name=name, keep=keep
    )
    poses = {arm: goal for arm, goal in asked.items() if isinstance(goal, PoseGoal)}
    if poses:
        wanted = {arm: poses.get(arm, as_goal(end[arm], "")) for arm in cell.arm_names}
        problem = dataclasses.replace(problem, goal_asked=wanted)
    return _proved(_on_one_clock(problem, lines))


def _asked(
    cell: Cell, to: Mapping[str, GivenGoal], by: Mapping[str, ArrayLike]
) -> dict[str, PoseGoal | Float[np.ndarray, "3"]]:
    out: dict[str, PoseGoal | Float[np.ndarray, "3"]] = {}
    for arm in [*to, *by]:
        if arm not in cell.arm_names:
            raise UnknownNameError("arm", str(arm), cell.arm_names)
        if arm in out:
            raise MmpError(f"arm '{arm}' has two straight lines: one in `to` and one in `by`")
        if arm in to:
            goal = as_goal(to[arm], f"the end of the line of arm '{arm}'")
            if not isinstance(goal, PoseGoal):
                raise refused(f"the end of the line of arm '{arm}'", to[arm], "a pose")
            out[arm] = goal
        else:
            vector = as_numbers(by[arm])
            if vector is None or vector.shape != (3,) or not np.isfinite(vector).all():
                raise refused(f"the displacement of arm '{arm}'", by[arm], "3 finite numbers [m]")
            out[arm] = vector
    if not out:
        raise MmpError("no tool moves: give `to` or `by` for an arm")
    return out


def _followed(
    problem: Problem, name: str, asked: PoseGoal | Float[np.ndarray, "3"], frame: str, tolerance: float
) -> FollowedLine:
    """Returns the configurations of an arm along its line. Raises `InvalidInstanceError` if it cannot follow it."""
    arm, q = problem.cell.arm(name), problem.start[name]
    chain = chain_of(arm.robot, arm.tool)
    return _whole(arm, chain, q, _line(arm, chain, q, asked, frame), tolerance)


def along_line(arm: Arm, q: Float[np.ndarray, "dof"], by: Float[np.ndarray, "3"], tolerance: float) -> FollowedLine:
    """Returns configurations along a straight line of a tool, which does not turn.

    Args:
        arm: the arm.
        q: where it begins [rad, of slides m].
        by: displacement of the tool in the world [m].
        tolerance: largest distance of the tool from the line [m], and of its rotation [rad].

    Raises:
        InvalidInstanceError: if the arm cannot follow the whole line.
    """
    chain = chain_of(arm.robot, arm.tool)
    return _whole(arm, chain, q, _line(arm, chain, q, by, "world"), tolerance)


def _whole(arm: Arm, chain: SerialChain, q: Float[np.ndarray, "dof"], line: ToolLine, tolerance: float) -> FollowedLine:
    box = JointBox(lower=arm.robot.lower, upper=arm.robot.upper, hinges=~np.array(arm.robot.slides))
    found = follow(chain, box, q, line, tolerance)
    if not found.whole:
        length = float(np.linalg.norm(line.end[:3, 3] - line.begin[:3, 3]))
        done = float(found.shares[-1])
        raise InvalidInstanceError(
            f"the tool of arm '{arm.name}' can follow {done:.0%} of its line ({done * length * 1e3:.1f} of"
            f" {length * 1e3:.1f} mm); there {_why_not_farther(arm, found)}"
        )
    return found


def _why_not_farther(arm: Arm, found: FollowedLine) -> str:
    if found.beyond >= 0:
        k = found.beyond
        return (
            f"joint {k + 1} ({arm.robot.joint_names[k]}) reaches its limit:"
            f" {arm.robot.lower[k]:.4f} to {arm.robot.upper[k]:.4f} {arm.robot.units[k]}"
        )
    return "the arm is stretched out or in another singular configuration"


def _line(
    arm: Arm,
    chain: SerialChain,
    q: Float[np.ndarray, "dof"],
    asked: PoseGoal | Float[np.ndarray, "3"],
    frame: str,
) -> ToolLine:
    """Returns the line of a tool in the base frame of its arm."""
    frames = chain.frames(q[None])
    begin = transform(frames.rotation[0], frames.position[0])
    in_base = np.linalg.inv(arm.T_world_base)
    if not isinstance(asked, PoseGoal):
        turn = begin[:3, :3] if frame == "tool" else in_base[:3, :3]
        return ToolLine(begin=begin, end=transform(begin[:3, :3], begin[:3, 3] + turn @ asked))
    position = (in_base @ np.append(asked.position, 1.0))[:3]
    rotation = begin[:3, :3]
    if asked.quaternion is not None and asked.free != "rotation":
        wanted = in_base[:3, :3] @ matrix_from_quaternion(asked.quaternion)
        rotation = _least_turn(rotation, wanted[:, 2]) if asked.free == "z" else wanted
    if np.trace(begin[:3, :3].T @ rotation) < 1 + 2 * math.cos(math.pi - _HALF_TURN):
        raise MmpError(f"the tool of arm '{arm.name}' would turn by half a turn; give a pose on the way first")
    return ToolLine(begin=begin, end=transform(rotation, position))


def _least_turn(rotation: Float[np.ndarray, "3 3"], z: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Returns the rotation turned as little as brings its z axis to a unit vector that is not opposite to it."""
    cosine = float(rotation[:, 2] @ z)
    x, y, z = np.cross(rotation[:, 2], z)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + cross + cross @ cross / (1 + cosine)) @ rotation


def _on_one_clock(problem: Problem, lines: Mapping[str, FollowedLine]) -> Plan:
    """Returns the plan in which all arms have done the same share of their lines at any time."""
    shares = np.unique(np.concatenate([line.shares for line in lines.values()]))
    positions = {name: np.repeat(q[None], len(shares), axis=0) for name, q in problem.start.items()}
    for name, line in lines.items():
        positions[name] = np.column_stack([np.interp(shares, line.shares, joint) for joint in line.q.T])
    steps = [
        (np.abs(np.diff(q, axis=0)) / problem.max_velocity[name]).max(axis=1, initial=0.0)
        for name, q in positions.items()
    ]
    lasting = np.maximum(np.max(steps, axis=0), 1e-9)
    times = np.concatenate([[0.0], np.cumsum(lasting + np.spacing(lasting.sum()))])
    return Plan(problem=problem, times=times, positions=positions)


def _proved(plan: Plan) -> Plan:
    """Returns the plan. Raises `InvalidInstanceError` if it has no certificate."""
    certificate = certify(plan, core.Clock(math.inf))
    if certificate.valid:
        return plan
    at = float(np.interp(certificate.instant, np.arange(len(plan.times)), plan.times))
    state, cell = plan.at(at), plan.problem.cell
    for name, bound in cell.keep.items():
        tilt = float(cell.collision.tilt(name, state[name][None])[0])
        if tilt > bound.within:
            raise not_upright(f"the straight line of arm '{name}'", tilt, bound)
    near = cell.collision.nearest(state)
    worst = min(near, key=lambda kind: near[kind].clearance_m - plan.problem.margins[kind])
    raise InvalidInstanceError(
        f"the straight line is not free: after {at / plan.makespan_s:.0%} of it, {near[worst].bodies} are"
        f" {how_far_apart(near[worst].clearance_m)}, and the margin is {plan.problem.margins[worst] * 1e3:g} mm"
    )
