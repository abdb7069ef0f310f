"""A problem: a cell, a start and a goal configuration per arm, and how fast and how close the arms may move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.brief import brief
from mmp_env.cell import Cell
from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.read_only import ReadOnly
from mmp_env.robot import frozen_array
from mmp_env.wording import counted, degrees_hint

DEFAULT_MAX_VELOCITY = 0.8
"""[rad/s] per joint, as in the paper; never above the robot's own limit."""
DEFAULT_MARGIN_M = 0.002


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem(ReadOnly):
    """One instance. `start`, `goal`: arm name -> [dof] [rad]; `max_velocity`: arm name -> [dof] [rad/s].

    Mappings and arrays are read-only, and so are those of copies.

    `margin` [m] is the one in force: no plan brings two bodies closer than half of it at any instant, and planners keep
    the whole of it at the instants they look at.
    """

    cell: Cell
    start: Mapping[str, Float[np.ndarray, "dof"]]
    goal: Mapping[str, Float[np.ndarray, "dof"]]
    max_velocity: Mapping[str, Float[np.ndarray, "dof"]]
    margin: float
    name: str = ""

    @brief
    def __repr__(self) -> str:
        cell = f"{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"
        cost = f"{self.cost_lower_bound_rad:.2f} rad along straight lines"
        return f"{self.name}{': ' if self.name else ''}{cell}, {cost}, margin {self.margin * 1e3:.2f} mm"

    @property
    def cost_lower_bound_rad(self) -> float:
        """sum_i |q_goal - q_start|_1 [rad], the only bound that holds for every planner."""
        return float(sum(np.abs(self.goal[a] - self.start[a]).sum() for a in self.cell.arm_names))


def make_problem(
    cell: Cell,
    start: Mapping[str, ArrayLike],
    goal: Mapping[str, ArrayLike],
    *,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float = DEFAULT_MARGIN_M,
    name: str = "",
) -> Problem:
    """A validated problem.

    The margin in force is the smaller of `margin` and 0.9 x the least clearance of start and goal (ALGORITHMS: it lets
    tight instances stay solvable). Raises `MmpError` for missing arms, wrong lengths or non-finite numbers, and
    `InvalidInstanceError` where start or goal is out of limits or in collision.
    """
    ends = {"start": _configurations(cell, start, "start"), "goal": _configurations(cell, goal, "goal")}
    if not (np.isfinite(margin) and margin > 0):
        raise MmpError(f"margin is {margin}; it must be a positive number of metres")
    least = np.inf
    for which, q in ends.items():
        _check_limits(cell, q, which)
        clearance, what = cell.collision.least_clearance(q)
        if clearance <= 0:
            raise InvalidInstanceError(f"{which} is in collision: {what} ({-clearance * 1e3:.1f} mm deep)")
        least = min(least, clearance)
    return Problem(
        cell=cell,
        start=ends["start"],
        goal=ends["goal"],
        max_velocity=velocity_limits(cell, max_velocity),
        margin=min(margin, 0.9 * least),
        name=name,
    )


def _configurations(cell: Cell, given: Mapping[str, ArrayLike], which: str) -> dict[str, np.ndarray]:
    for name in given:
        if name not in cell.arm_names:
            raise MmpError(f"{which}: {UnknownNameError('arm', name, cell.arm_names)}")
    out = {}
    for arm in cell.arms:
        if arm.name not in given:
            raise MmpError(f"{which} has no configuration for arm '{arm.name}'")
        try:
            q = frozen_array(given[arm.name])
        except (TypeError, ValueError, OverflowError):
            raise MmpError(f"{which} of arm '{arm.name}' is not a list of numbers") from None
        if q.shape != (arm.dof,):
            raise MmpError(
                f"{which} of arm '{arm.name}' has shape {list(q.shape)}; a {arm.robot.name} has {arm.dof} joints"
            )
        if not np.isfinite(q).all():
            raise MmpError(f"{which} of arm '{arm.name}' holds {q[~np.isfinite(q)][0]}; it must be finite numbers")
        out[arm.name] = q
    return out


def _check_limits(cell: Cell, q: Mapping[str, np.ndarray], which: str) -> None:
    for arm in cell.arms:
        outside = (q[arm.name] < arm.robot.lower) | (q[arm.name] > arm.robot.upper)
        if outside.any():
            in_degrees = outside & [bool(degrees_hint(angle)) for angle in q[arm.name]]
            k = int(np.argmax(in_degrees if in_degrees.any() else outside))
            raise InvalidInstanceError(
                f"{which} of arm '{arm.name}', joint {k + 1} ({arm.robot.joint_names[k]}), is {q[arm.name][k]:.4f} rad;"
                f" allowed: {arm.robot.lower[k]:.4f} to {arm.robot.upper[k]:.4f}{degrees_hint(q[arm.name][k])}"
            )


def velocity_limits(cell: Cell, given: float | Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Arm name -> [dof] [rad/s]: what is `given`, never above the robot's own limit. Raises `MmpError`."""
    out = {}
    for arm in cell.arms:
        if isinstance(given, Mapping):
            if arm.name not in given:
                raise MmpError(f"max_velocity has no entry for arm '{arm.name}'")
            wanted = _floats(given[arm.name])
        else:
            wanted = _floats([given] * arm.dof)
        if wanted.shape != (arm.dof,) or not (np.isfinite(wanted) & (wanted > 0)).all():
            raise MmpError(f"max_velocity of arm '{arm.name}' must be {arm.dof} positive numbers [rad/s]")
        out[arm.name] = frozen_array(np.minimum(wanted, arm.robot.velocity))
    return out


def _floats(given: ArrayLike) -> np.ndarray:
    """The numbers as an array; NaN for what is none, such as text or a whole number beyond all floats."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return np.array(np.nan)
