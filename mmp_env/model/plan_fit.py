"""Tests that a plan can be played in a cell: that it is well formed, and made for these arms and obstacles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.collision import LARGEST_POSITION
from mmp_env.model.plan import Plan, how_to_plan, what_else
from mmp_env.model.transforms import matrix_from_quaternion

LONGEST_EXECUTION_S = 1200.0
"""Longest plan that is executed [s]: an execution keeps the positions of all physics steps in memory."""
_SAME = 1e-6
"""Largest difference between equal poses and sizes [m]."""
_MOST_SHOWN = 9
"""Largest number of values that a message shows."""


def given_plan(plan: object, to: str) -> Plan:
    """Returns the plan. Raises `MmpError` for None, which a planner returns without a plan, and for other objects.

    `to` is a verb for the message, such as `save`.
    """
    if plan is None:
        raise MmpError(f"there is no plan to {to}; the status of the planner's result says why it found none")
    if not isinstance(plan, Plan):
        raise MmpError(f"the plan to {to} is {what_else(plan)}; it must be a Plan{how_to_plan(plan)}")
    return plan


def check_fit(plan: Plan, cell: Cell) -> None:
    """Raises `MmpError` for a plan of other arms or obstacles than those of `cell`, or of wrong shapes or times.

    The plan's cell may have fewer arms. Name and sphere set of the cell may differ.
    """
    difference = None if plan.problem.cell is cell else next(_differences(plan.problem.cell, cell), None)
    if difference is not None:
        raise MmpError(f"the plan is for another cell: {difference}")
    fault = next(_faults(plan), None)
    if fault is not None:
        raise MmpError(f"the plan is malformed: {fault}")


def check_duration(plan: Plan) -> None:
    """Raises `MmpError` for a plan that is too long to be executed."""
    if not plan.makespan_s <= LONGEST_EXECUTION_S:
        raise MmpError(
            f"the plan takes {plan.makespan_s:.6g} s; a plan that is executed takes {LONGEST_EXECUTION_S:g} s at most"
        )


def _differences(planned: Cell, cell: Cell) -> Iterator[str]:
    arms = {arm.name: arm for arm in cell.arms}
    for arm in planned.arms:
        if arm.name not in arms:
            yield f"it has an arm '{arm.name}', the arms here are {', '.join(arms)}"
        else:
            yield from _unequal(f"arm '{arm.name}'", _traits(arm), _traits(arms[arm.name]))
    here = {obstacle.name: obstacle for obstacle in cell.obstacles}
    there = {obstacle.name: obstacle for obstacle in planned.obstacles}
    if here.keys() != there.keys():
        yield f"its obstacles are {', '.join(there) or 'none'}, those here are {', '.join(here) or 'none'}"
    for name in here.keys() & there.keys():
        yield from _unequal(f"obstacle '{name}'", _measures(there[name]), _measures(here[name]))


def _traits(arm: Arm) -> dict[str, object]:
    return {
        "robot": arm.robot.name,
        "tool": arm.tool.name if arm.tool else "none",
        "position": arm.position,
        "orientation": arm.T_world_base[:3, :3].ravel(),
        "held object": arm.held.shape if arm.held else "none",
    } | ({f"{key} of the held object": value for key, value in _measures(arm.held).items()} if arm.held else {})


def _measures(obstacle: Obstacle) -> dict[str, object]:
    return {
        "shape": obstacle.shape,
        "position": obstacle.position,
        "orientation": matrix_from_quaternion(obstacle.quaternion).ravel(),
        "size": obstacle.size,
        "radius": obstacle.radius,
        "length": obstacle.length,
        "number of pieces": len(obstacle.pieces),
        "vertices": np.concatenate([piece.ravel() for piece in obstacle.pieces]) if obstacle.pieces else None,
        "allowed contacts": ", ".join(sorted(obstacle.may_touch)) or "none",
        "speed": f"{obstacle.speed:g} m/s",
    }


def _unequal(whose: str, there: dict[str, object], here: dict[str, object]) -> Iterator[str]:
    for key, value in there.items():
        other = here.get(key)
        if isinstance(value, np.ndarray) and isinstance(other, np.ndarray):
            if value.shape != other.shape or not np.allclose(value, other, rtol=0, atol=_SAME):
                yield f"the {key} of {whose} is {_shown(value)} there and {_shown(other)} here"
        elif isinstance(value, float) and isinstance(other, float):
            if abs(value - other) > _SAME:
                yield f"the {key} of {whose} is {value:g} m there and {other:g} m here"
        elif value != other:
            yield f"the {key} of {whose} is {value} there and {other} here"


def _shown(values: np.ndarray) -> str:
    shown = [round(float(value), 6) for value in values[:_MOST_SHOWN]]
    return str(shown) if len(values) <= _MOST_SHOWN else f"{str(shown)[:-1]}, ...]"


def _faults(plan: Plan) -> Iterator[str]:
    times = np.asarray(plan.times)
    if times.ndim != 1 or len(times) == 0 or times[0] != 0 or not np.isfinite(times).all():
        yield "its times must be a list of finite numbers that begins with 0"
    elif (np.diff(times) <= 0).any():
        yield f"its times do not ascend after {times[np.argmax(np.diff(times) <= 0)]:g} s"
    if not plan.positions:
        yield "it moves no arm"
    names = plan.problem.cell.arm_names
    for kind in ("positions", "velocities", "accelerations"):
        rows_by_arm = getattr(plan, kind)
        if rows_by_arm is None:
            continue
        if rows_by_arm.keys() != plan.positions.keys():
            yield f"it has {kind} of other arms than positions"
        for name, rows in rows_by_arm.items():
            if name not in names:
                yield f"it has {kind} of an arm '{name}', which is not in its cell"
            elif np.shape(rows) != (len(times), plan.problem.cell.arm(name).dof):
                wanted = [len(times), plan.problem.cell.arm(name).dof]
                yield f"its {kind} of arm '{name}' have shape {list(np.shape(rows))}; expected {wanted}"
            elif not np.isfinite(rows).all():
                yield f"its {kind} of arm '{name}' hold a number that is not finite"
            elif kind == "positions" and np.abs(rows).max(initial=0.0) > LARGEST_POSITION:
                yield f"its positions of arm '{name}' reach beyond {LARGEST_POSITION:g}"
