"""Execution of a plan: played through the actuators of a simulated cell, watched for contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.contacts import Contact
from mmp_env.plan import Plan
from mmp_env.plan_fit import check_fit
from mmp_env.simulation import Simulation

REACHED_RAD = 0.02
"""An arm has reached a configuration when every joint is this close to it."""
SETTLE_S = 0.5
"""After the last time of a plan the servos hold its end until all is at rest, at most this long."""
_NEAR_RAD, _AT_REST_RAD_S = 1e-3, 1e-3
_STRETCH = 20
"""Physics steps between two calls of `show`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ExecutionReport:
    """What became of a plan in the simulation.

    `reached`: every joint of every arm ended within `REACHED_RAD` of its goal. `contacts`: between different arms, or
    an arm and an obstacle, earliest first, in time since the beginning. `max_tracking_error_rad`: the farthest that a
    joint was from where the plan had it at that time. `duration_s`: simulated time, settling included.
    `moved_to_start`: the arms stood elsewhere and were put to the plan's start first. `times` [t] [s] and `positions`,
    arm -> [t, dof] [rad], are what was recorded at each physics step, the beginning included.
    """

    reached: bool
    contacts: list[Contact]
    max_tracking_error_rad: float
    duration_s: float
    moved_to_start: bool
    times: Float[np.ndarray, "t"]
    positions: Mapping[str, Float[np.ndarray, "t dof"]]


def execute_plan(simulation: Simulation, plan: Plan, show: Callable[[], None] = lambda: None) -> ExecutionReport:
    """Plays `plan` from its start; arms that it does not move hold still. Calls `show` every 40 ms of simulated time.

    The arms follow the plan's positions with its velocities (those of its straight segments where it has none) as
    feed-forward, at every physics step. Raises `MmpError` for a plan of another cell or one that is malformed.
    """
    check_fit(plan, simulation.cell)
    standing = simulation.split(simulation.positions)
    start = {name: plan.positions[name][0] if name in plan.positions else standing[name] for name in standing}
    moved = any(np.abs(start[name] - standing[name]).max() > REACHED_RAD for name in standing)
    if moved:
        simulation.place(simulation.joined(start))
    begin = simulation.positions
    simulation.begin_log()
    passed, error = _play(simulation, plan, start, show)
    held, rest_error = _settle(simulation, simulation.joined(_ends(plan, start)), show)
    recorded = np.concatenate([begin[None], passed, held])
    end = simulation.split(recorded[-1])
    times = simulation.timestep_s * np.arange(len(recorded))
    return ExecutionReport(
        reached=all(np.abs(end[name] - plan.problem.goal[name]).max() <= REACHED_RAD for name in plan.positions),
        contacts=simulation.log.contacts,
        max_tracking_error_rad=max(error, rest_error),
        duration_s=float(times[-1]),
        moved_to_start=bool(moved),
        times=times,
        positions=simulation.split(recorded),
    )


def _ends(plan: Plan, start: Mapping[str, Float[np.ndarray, "dof"]]) -> dict[str, Float[np.ndarray, "dof"]]:
    return {name: plan.positions[name][-1] if name in plan.positions else q for name, q in start.items()}


def _play(
    simulation: Simulation, plan: Plan, start: Mapping[str, Float[np.ndarray, "dof"]], show: Callable[[], None]
) -> tuple[Float[np.ndarray, "t n"], float]:
    """Where the arms were after each physics step, and the largest error, until the last time of the plan."""
    step_s = simulation.timestep_s
    count = int(np.ceil(plan.makespan_s / step_s - 1e-9))
    clock = step_s * np.arange(count + 1)
    sampled = [_sampled(plan, name, q, clock) for name, q in start.items()]
    reference = np.concatenate([positions for positions, _ in sampled], axis=1)
    velocity = np.concatenate([velocities for _, velocities in sampled], axis=1)
    passed = np.empty((count, simulation.count))
    for first in range(0, count, _STRETCH):
        part = slice(first, min(first + _STRETCH, count))
        passed[part] = simulation.follow(reference[part], velocity[part])
        show()
    return passed, float(np.abs(passed - reference[1:]).max(initial=0.0))


def _settle(
    simulation: Simulation, end: Float[np.ndarray, "n"], show: Callable[[], None]
) -> tuple[Float[np.ndarray, "t n"], float]:
    """As `_play`, while the servos hold `end`."""
    reference, passed = np.tile(end, (_STRETCH, 1)), []
    for _ in range(round(SETTLE_S / simulation.timestep_s / _STRETCH)):
        passed.append(simulation.follow(reference, np.zeros_like(reference)))
        show()
        near = np.abs(passed[-1][-1] - end).max() <= _NEAR_RAD
        if near and np.abs(simulation.velocities).max() <= _AT_REST_RAD_S:
            break
    return np.concatenate(passed), float(np.abs(np.concatenate(passed) - end).max())


def _sampled(
    plan: Plan, name: str, q: Float[np.ndarray, "dof"], clock: Float[np.ndarray, "t"]
) -> tuple[Float[np.ndarray, "t dof"], Float[np.ndarray, "t dof"]]:
    """Positions and velocities of one arm at the times of `clock`; at rest at `q` where the plan does not move it."""
    if name not in plan.positions:
        return np.tile(q, (len(clock), 1)), np.zeros((len(clock), len(q)))
    times, planned = plan.times, plan.positions[name]
    positions = np.column_stack([np.interp(clock, times, column) for column in planned.T])
    if plan.velocities is not None:
        columns = plan.velocities[name].T
        return positions, np.column_stack([np.interp(clock, times, column) for column in columns])
    slopes = np.zeros_like(planned)
    slopes[:-1] = np.diff(planned, axis=0) / np.diff(times)[:, None]
    return positions, slopes[np.searchsorted(times, clock, side="right") - 1]
