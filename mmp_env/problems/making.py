"""Makes problems from what a user gives: start, goals, velocity limits and margins, all checked."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, known_keywords, refused
from mmp_env.errors import InvalidInstanceError, MmpError, MovedBodyWarning, UnknownNameError
from mmp_env.model.cell import Arm, Cell, given_cell
from mmp_env.model.collision import Nearest
from mmp_env.model.goals import AnyOf, GivenGoal, Goal, JointGoal, Stay, as_goal, flat
from mmp_env.model.keep import GivenKeep, as_keep
from mmp_env.model.margins import (
    KIND_WORDS,
    KINDS,
    LEAST_MARGIN_M,
    TIGHT_FACTOR,
    Margins,
    asked_margins,
    largest_margin,
    margin_in_force,
    millimetres,
)
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem, asked_velocity_limits, upright_room
from mmp_env.problems.candidates import not_upright, wrong_shape
from mmp_env.problems.resolution import Resolved, keeping, resolve
from mmp_env.wording import degrees_hint, how_far_apart

MOVED = 1e-3
"""Difference of a held joint or free body [rad or m] from its value in the cell, above which a warning tells it."""
LEAST_ROOM_RAD = 2.5e-5
"""Least angle [rad] by which the tool axes of start and goal are within their bounds, so that plans can be proved."""
_LEAST_CLEARANCE_M = LEAST_MARGIN_M / TIGHT_FACTOR
"""Least clearance [m] of start and goal. Closer bodies touch, because no margin would be left."""
_LONG = 1e6
"""Least joint position that is written with an exponent."""


@known_keywords
def make_problem(
    cell: Cell,
    start: Mapping[str, GivenGoal] | ArrayLike,
    goal: Mapping[str, GivenGoal] | ArrayLike,
    *,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float | Mapping[str, float] | Margins | None = None,
    name: str = "",
    keep: GivenKeep | None = None,
) -> Problem:
    """Returns a validated problem.

    A plan keeps a margin that is asked for at every instant, or the instance is refused. A margin that is not asked for
    is 2 mm, or 0.8 times the least clearance of start and goal if that is less.

    Args:
        cell: arms and obstacles, such as `ring_cell` or `load_cell` gives.
        start: for every arm of the cell: arm name -> a configuration [dof] [rad], a `PoseGoal`, or `home` or `tucked`.
            Or a configuration of the whole model, such as `data.qpos`, for a cell of `cell_from_mujoco`.
        goal: in the same forms, and also `stay` and `AnyOf`. `as_goal` also reads the forms of JSON. All configurations
            that bring a tool to its pose are candidates, and the planner chooses among them.
        max_velocity: [rad/s] for all joints, or arm name -> a number or [dof]; a robot's own limit holds as well.
        margin: [m] between arms and to obstacles; or a mapping with any of `arms`, `obstacles`, `self`.
        name: name of the instance, such as `<cell>/<instance>`.
        keep: arm name -> bound of its tool axis at every instant: an `Upright`, or
            `{"upright": {"axis": [0, 0, 1], "within": 0.2}}`; by default the bounds of `cell.keep`.

    Raises:
        MmpError: for missing arms, wrong lengths, numbers that are not finite, a bad margin, bound or name.
        InvalidInstanceError: if start or goal is out of limits, in collision, closer than a margin asked for, or breaks
            the bound of a tool axis.
    """
    given_cell(cell)
    if moving := [obstacle.name for obstacle in cell.obstacles if obstacle.speed]:
        raise MmpError(f"obstacle '{moving[0]}' moves; OnlinePlanner plans among obstacles that move, others do not")
    if keep is not None:
        cell = replace(cell, keep=as_keep(keep, cell.arm_names))
    asked = asked_margins(margin)
    limits = asked_velocity_limits(cell, max_velocity)
    wanted = {"start": _asked(cell, start, "start"), "goal": _asked(cell, goal, "goal")}
    home = {arm.name: arm.robot.home for arm in cell.arms}
    begin = _resolved(cell, wanted["start"], home, {}, asked, "start").chosen
    near = {"start": _checked(cell, begin, "start")}
    end = _resolved(cell, wanted["goal"], begin, near["start"], asked, "goal")
    near["goal"] = _checked(cell, end.chosen, "goal")
    _check_margins(near, asked)
    margins = _margins(near.values(), asked)
    return Problem(
        cell=cell,
        start=begin,
        goal=end.chosen,
        max_velocity=limits,
        margins=margins,
        name=name,
        goals=keeping(cell, end, wanted["goal"], margins),
        goal_asked={} if _are_configurations(wanted["goal"]) else wanted["goal"],
    )


def _asked(cell: Cell, given: Mapping[str, GivenGoal] | ArrayLike, which: str) -> dict[str, Goal]:
    """Returns arm name -> what is asked for, for every arm of the cell. Raises `MmpError`."""
    if not isinstance(given, Mapping):
        given = _of_whole_model(cell, given, which)
    for name in given:
        if name not in cell.arm_names:
            raise MmpError(f"{which}: {UnknownNameError('arm', name, cell.arm_names)}")
    out: dict[str, Goal] = {}
    for arm in cell.arms:
        if arm.name not in given:
            raise MmpError(f"{which} has no configuration for arm '{arm.name}'")
        out[arm.name] = as_goal(given[arm.name], f"{which} of arm '{arm.name}'")
        if which == "start" and isinstance(out[arm.name], Stay | AnyOf):
            raise MmpError(
                f"start of arm '{arm.name}' must be one configuration or pose; 'stay' and 'any' are for goals"
            )
    return out


def _are_configurations(asked: Mapping[str, Goal]) -> bool:
    return all(isinstance(goal, JointGoal) for goal in asked.values())


def _resolved(
    cell: Cell,
    wanted: Mapping[str, Goal],
    preferred: Mapping[str, np.ndarray],
    near: Mapping[str, Nearest],
    asked: Mapping[str, float],
    which: str,
) -> Resolved:
    """Returns the configurations of what is wanted. `near`: the nearest bodies at the start, none for the start."""
    for arm in cell.arms:
        goal = wanted[arm.name]
        if isinstance(goal, JointGoal) and goal.q.shape != (arm.dof,):
            raise wrong_shape(arm, goal, f"{which} of arm '{arm.name}'")
    given = {name: goal.q for name, goal in wanted.items() if isinstance(goal, JointGoal)}
    for arm in cell.arms:
        every = [goal.q for goal in flat(wanted[arm.name]) if isinstance(goal, JointGoal)]
        if len(every) == len(flat(wanted[arm.name])) and not any(_within_limits(arm, q) for q in every):
            _check_limits(cell, {arm.name: every[0]}, which)
    if len(given) == len(wanted):
        alone = {name: q[None] for name, q in given.items()}
        return Resolved(
            chosen=given, candidates=alone, margins=Margins(arms=math.inf, obstacles=math.inf, self=math.inf)
        )
    return resolve(cell, wanted, preferred, _margins([near] if near else [], asked), asked, which)


def _checked(cell: Cell, q: Mapping[str, np.ndarray], which: str) -> dict[str, Nearest]:
    """Returns the nearest bodies. Raises `InvalidInstanceError` for a state out of limits or in collision."""
    _check_limits(cell, q, which)
    _check_upright(cell, q, which)
    near = cell.collision.nearest(q)
    for bodies, metres in near.values():
        if metres < _LEAST_CLEARANCE_M:
            raise InvalidInstanceError(f"{which} is in collision: {bodies} ({how_far_apart(metres)})")
    return near


def _margins(near: Iterable[Mapping[str, Nearest]], asked: Mapping[str, float]) -> Margins:
    """Returns the margins in force for states with these nearest bodies."""
    least = {kind: min([each[kind].clearance_m for each in near], default=math.inf) for kind in KINDS}
    return Margins(**{kind: margin_in_force(kind, asked, least[kind]) for kind in KINDS})


def _check_upright(cell: Cell, q: Mapping[str, np.ndarray], which: str) -> None:
    """Raises `InvalidInstanceError` if a tool axis is not within its bound, with room to plan in."""
    for name, bound in cell.keep.items():
        room = upright_room(cell, q, name)
        if room < LEAST_ROOM_RAD:
            raise not_upright(f"{which} of arm '{name}'", bound.within - room, bound)


def _check_margins(near: Mapping[str, Mapping[str, Nearest]], asked: Mapping[str, float]) -> None:
    """Raises `InvalidInstanceError` if start or goal is closer than a margin that was asked for.

    Args:
        near: `start`, `goal` -> kind of margin -> the nearest bodies.
    """
    tightest = {kind: min(near, key=lambda which: near[which][kind].clearance_m) for kind in asked}
    largest = {kind: largest_margin(near[which][kind].clearance_m) for kind, which in tightest.items()}
    broken = [kind for kind in asked if asked[kind] > largest[kind]]
    if not broken:
        return
    worst = min(broken, key=lambda kind: largest[kind])
    which, (bodies, metres) = tightest[worst], near[tightest[worst]][worst]
    same = all(abs(ends[worst].clearance_m - metres) < 1e-6 and ends[worst].bodies == bodies for ends in near.values())
    if len({asked[kind] for kind in broken}) == 1:
        most = f"the largest that would do is {millimetres(largest[worst])} mm"
    else:
        most = "the largest that would do are " + " and ".join(
            f"{millimetres(largest[kind])} mm {KIND_WORDS[kind]}" for kind in broken
        )
    raise InvalidInstanceError(
        f"{'start and goal' if same else which}: {bodies} are {metres * 1e3:.2f} mm apart, and the margin asked for"
        f" {KIND_WORDS[worst]} is {asked[worst] * 1e3:g} mm; {most if largest[worst] >= 1e-5 else 'no margin would do'}"
    )


def _of_whole_model(cell: Cell, given: ArrayLike, which: str) -> Mapping[str, np.ndarray]:
    """Returns the configurations in a `qpos` of the model that a cell was made from. Raises `MmpError`."""
    numbers = as_numbers(given) if cell.joints is not None else None
    if cell.joints is None or numbers is None or numbers.ndim != 1:
        raise refused(which, given, "a mapping of arm name -> joints [rad]")
    size = len(cell.joints.qpos)
    if len(numbers) != size:
        raise MmpError(f"{which} has {len(numbers)} numbers; the qpos of the model of cell '{cell.name}' has {size}")
    index, away = cell.joints.deviation(numbers)
    if away > MOVED:
        warnings.warn(
            f"{which}: qpos[{index}] is {numbers[index]:.4g}, and cell '{cell.name}' was made with"
            f" {cell.joints.qpos[index]:.4g}; make it with cell_from_mujoco(..., qpos=data.qpos)",
            MovedBodyWarning,
            stacklevel=4,
        )
    return cell.joints.configurations(numbers)


def _within_limits(arm: Arm, q: np.ndarray) -> bool:
    return q.shape != (arm.dof,) or bool(((arm.robot.lower <= q) & (q <= arm.robot.upper)).all())


def _check_limits(cell: Cell, q: Mapping[str, np.ndarray], which: str) -> None:
    """Raises `InvalidInstanceError` for a joint out of its limits, of the arms in `q`."""
    for arm in (each for each in cell.arms if each.name in q):
        outside = (q[arm.name] < arm.robot.lower) | (q[arm.name] > arm.robot.upper)
        if outside.any():
            hints = [
                "" if slides else degrees_hint(at) for at, slides in zip(q[arm.name], arm.robot.slides, strict=True)
            ]
            in_degrees = outside & [bool(hint) for hint in hints]
            k = int(np.argmax(in_degrees if in_degrees.any() else outside))
            given = q[arm.name][k]
            raise InvalidInstanceError(
                f"{which} of arm '{arm.name}', joint {k + 1} ({arm.robot.joint_names[k]}), is"
                f" {given:{'.4f' if abs(given) < _LONG else 'g'}} {arm.robot.units[k]};"
                f" allowed: {arm.robot.lower[k]:.4f} to {arm.robot.upper[k]:.4f}{hints[k]}"
            )
