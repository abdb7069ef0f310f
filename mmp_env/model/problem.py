"""A problem: a cell, a start and a goal of each arm, velocity limits, and margins."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.argument_checks import as_numbers, refused, text
from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.cell import Arm, Cell
from mmp_env.model.collision import levels_of
from mmp_env.model.goals import Goal
from mmp_env.model.keep import Upright
from mmp_env.model.margins import (
    KINDS,
    Margins,
    check_margins,
    largest_margin,
    planning_slack,
)
from mmp_env.model.names import INSTANCE_NAMES, is_instance_name
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import frozen_array
from mmp_env.wording import counted

DEFAULT_MAX_VELOCITY = 0.8
"""Velocity limit [rad/s] of every joint, that of the paper arXiv 2509.13882; a robot's own limit holds as well."""
PLAUSIBLE_VELOCITY = 4 * np.pi
"""Largest velocity limit [rad/s] that is plausible for a slower robot: two turns a second. Above are degrees."""

LEAST_LIMIT = 1e-9
"""Lower bound of requested velocity [rad/s], acceleration [rad/s^2] and jerk limits [rad/s^3]; of slides in m."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem(ReadOnly):
    """One instance. `make_problem` makes a validated one. Mappings and arrays are read-only, also in copies.

    Attributes:
        cell: arms and obstacles.
        start: arm name -> [dof] [rad].
        goal: arm name -> [dof] [rad]: the chosen candidate of each arm. All of them are free together.
        max_velocity: arm name -> [dof] [rad/s].
        margins: clearances [m] that a plan keeps at every instant, start and goal included.
        name: name of the instance, such as `<cell>/<instance>`, or empty.
        goals: arm name -> [n, dof] [rad]: the candidates of each arm, at any of which a plan may end. Each is free
            alone; the nearest to the start comes first. By default `goal` alone.
        goal_asked: arm name -> what was asked for, if it was more than configurations; otherwise empty.

    Raises:
        MmpError: for margins that are not numbers above 0, and a bad name.
    """

    cell: Cell
    start: Mapping[str, Float[np.ndarray, "dof"]]
    goal: Mapping[str, Float[np.ndarray, "dof"]]
    max_velocity: Mapping[str, Float[np.ndarray, "dof"]]
    margins: Margins
    name: str = ""
    goals: Mapping[str, Float[np.ndarray, "n dof"]] = field(default_factory=dict)
    goal_asked: Mapping[str, Goal] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.goals:
            object.__setattr__(self, "goals", {name: np.asarray(q)[None] for name, q in self.goal.items()})
        super().__post_init__()
        check_margins(self.margins)
        if not is_instance_name(text("name", self.name)):
            raise refused("name", self.name, INSTANCE_NAMES)

    @brief
    def __repr__(self) -> str:
        cell = f"{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"
        cost = f"{self.cost_lower_bound_rad:.2f} rad along straight lines"
        return f"{self.name}{': ' if self.name else ''}{cell}, {cost}, margin {self.margins}"

    @property
    def margin(self) -> float:
        """The margin between arms [m]."""
        return self.margins.arms

    @property
    def keep(self) -> Mapping[str, Upright]:
        """Arm name -> bound of the angle between a tool axis and the world's z axis, kept at every instant."""
        return self.cell.keep

    @cached_property
    def slack(self) -> float:
        """Slack [m] that planners add to the margins, so that the proof of the margins ends.

        It follows from the margins and from the clearance of start and goal.
        """
        ends = self.start, self.goal
        room = min((upright_room(self.cell, q, name) for q in ends for name in self.keep), default=math.inf)
        return planning_slack(self.margins, _least_clearances(self.cell, ends), room)

    def levels(self, looked: float, proved: float) -> core.Levels:
        """Returns the clearances that the core tests and proves: the margins and shares of the planning slack.

        Args:
            looked: share of the slack at the tested instants, such as `SEARCH_MARGIN_FACTOR`.
            proved: share of the slack at every instant, such as `PLAN_MARGIN_FACTOR`.
        """
        return levels_of(self.margins, looked * self.slack, proved * self.slack)

    @property
    def conflict_distances(self) -> Margins:
        """Clearances [m] below which planners see a conflict: the margins and the slack."""
        return Margins(**{kind: self.margins[kind] + self.slack for kind in KINDS})

    @cached_property
    def cost_lower_bound_rad(self) -> float:
        """Lower bound of the cost of every plan: sum_i min_q |q - q_start|_1 [rad] over the candidates q of arm i."""
        return float(sum(np.abs(self.goals[a] - self.start[a]).sum(axis=1).min() for a in self.cell.arm_names))

    @cached_property
    def single_goals(self) -> bool:
        """Whether every arm has one candidate only."""
        return all(len(candidates) == 1 for candidates in self.goals.values())

    @cached_property
    def joint_start(self) -> Float[np.ndarray, "all_dof"]:
        """Start of the joints of all arms [rad, of slides m], in the order of the arms."""
        return self._joined(self.start)

    @cached_property
    def joint_goal(self) -> Float[np.ndarray, "all_dof"]:
        """Goal of the joints of all arms [rad, of slides m], in the order of the arms."""
        return self._joined(self.goal)

    @cached_property
    def joint_max_velocity(self) -> Float[np.ndarray, "all_dof"]:
        """Velocity limits of the joints of all arms [rad/s, of slides m/s], in the order of the arms."""
        return self._joined(self.max_velocity)

    def _joined(self, of_arm: Mapping[str, Float[np.ndarray, "dof"]]) -> Float[np.ndarray, "all_dof"]:
        return frozen_array(np.concatenate([of_arm[name] for name in self.cell.arm_names]))

    def choosing(self, goal: Mapping[str, Float[np.ndarray, "dof"]]) -> Problem:
        """Returns the same problem with other candidates, arm name -> [dof] [rad], as its `goal`."""
        if all(np.array_equal(goal[name], self.goal[name]) for name in self.cell.arm_names):
            return self
        return replace(self, goal={name: frozen_array(goal[name]) for name in self.cell.arm_names})


def keeps_margins(cell: Cell, states: Sequence[Mapping[str, Float[np.ndarray, "dof"]]], margins: Margins) -> bool:
    """Returns whether a plan can keep the margins in each of the states, arm name -> [dof] [rad]."""
    clearances = _least_clearances(cell, states)
    return all(margins[kind] <= largest_margin(clearances[kind]) for kind in KINDS)


def upright_room(cell: Cell, state: Mapping[str, Float[np.ndarray, "dof"]], arm: str) -> float:
    """Returns the angle [rad] by which an arm's tool axis is within its bound; negative outside."""
    return cell.keep[arm].within - float(cell.collision.tilt(arm, state[arm][None])[0])


def _least_clearances(cell: Cell, states: Sequence[Mapping[str, Float[np.ndarray, "dof"]]]) -> dict[str, float]:
    """Returns kind of margin -> the least clearance [m] in any of the states."""
    found = [cell.collision.nearest(state) for state in states]
    return {kind: min(near[kind].clearance_m for near in found) for kind in KINDS}


def asked_velocity_limits(cell: Cell, given: float | Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Returns `velocity_limits` of a user's request. Raises `MmpError` also for apparent degrees per second."""
    limits = velocity_limits(cell, given)
    for arm in cell.arms:
        wanted = np.broadcast_to(_floats(given[arm.name] if isinstance(given, Mapping) else given), arm.dof)
        for k, velocity in enumerate(wanted.tolist()):
            if velocity > max(arm.robot.velocity[k], PLAUSIBLE_VELOCITY):
                raise MmpError(
                    f"max_velocity of arm '{arm.name}', joint {k + 1} ({arm.robot.joint_names[k]}), is {velocity:g}"
                    f" {arm.robot.units[k]}/s; the robot's own limit is {arm.robot.velocity[k]:g};"
                    f" are these {'millimetres' if arm.robot.slides[k] else 'degrees'} per second?"
                )
    return limits


def velocity_limits(cell: Cell, given: float | Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Returns arm name -> [dof] [rad/s]: the `given` limits, or the robot's own if they are lower.

    Raises `MmpError`.
    """
    out = {}
    for arm in cell.arms:
        if isinstance(given, Mapping) and arm.name not in given:
            raise MmpError(f"max_velocity has no entry for arm '{arm.name}'")
        wanted = given[arm.name] if isinstance(given, Mapping) else given
        wanted = limits_per_joint("max_velocity", arm, wanted, arm.robot.velocity, " [rad/s]")
        out[arm.name] = frozen_array(np.minimum(wanted, arm.robot.velocity))
    return out


def limits_per_joint(
    name: str, arm: Arm, given: ArrayLike, own: Float[np.ndarray, "dof"], unit: str = ""
) -> Float[np.ndarray, "dof"]:
    """Returns the limits [dof] of an arm's joints from one number for all of them, or one for each.

    Raises:
        MmpError: for anything but positive numbers, and for one below `LEAST_LIMIT` and the robot's `own` limit. The
            message calls the limits `name`.
    """
    wanted = _floats(given)
    if wanted.ndim == 0:
        wanted = np.full(arm.dof, wanted)
    if wanted.shape != (arm.dof,) or not (np.isfinite(wanted) & (wanted > 0)).all():
        raise MmpError(f"{name} of arm '{arm.name}' must be a positive number, or {arm.dof} of them{unit}")
    if (wanted < np.minimum(LEAST_LIMIT, own)).any():
        least = f"it must be {LEAST_LIMIT:g}{unit} at least"
        raise MmpError(f"{name} of arm '{arm.name}' is {float(wanted.min())!r}; {least}")
    return wanted


def _floats(given: ArrayLike) -> np.ndarray:
    """Returns the numbers as an array; NaN for text, and for whole numbers beyond all floats."""
    numbers = as_numbers(given)
    return np.array(np.nan) if numbers is None else numbers
