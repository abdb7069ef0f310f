"""Execution of a plan through the actuators of a simulated cell, with a report of contacts, torques and lag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_duration, check_fit
from mmp_env.sim.clearance_audit import ClearanceAudit, audit_clearance
from mmp_env.sim.contacts import Contact
from mmp_env.sim.driven import Driven
from mmp_env.sim.monitor import Halt, Monitor, MonitorRun
from mmp_env.sim.phase_clock import PhaseClock
from mmp_env.sim.servo_reference import Reference
from mmp_env.sim.torque_report import PeakTorque, peak_torques
from mmp_env.wording import counted, in_seconds

REACHED_RAD = 0.02
"""Largest distance of a joint from its goal in an arm that has reached the goal [rad, of a slide m]."""
SETTLE_S = 0.5
"""Longest time that the servos hold the end of a plan until all joints are at rest."""
_SETTLED_RAD, _SETTLED_RAD_S = 1e-3, 1e-3
"""Largest distance from the end, and largest velocity, of a joint at rest."""
SHOWN_STEPS = 20
"""Physics steps between two pictures in a window or a recording, for 25 pictures per second."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ExecutionReport:
    """The result of an execution.

    Attributes:
        reached: whether every joint of every arm ended within `REACHED_RAD` of its goal.
        contacts: contacts of arms with each other, with obstacles and with themselves, earliest first.
        max_tracking_error_rad: largest distance of a joint from its reference [rad, of a slide m].
        unit: unit of that distance: `rad`, `m` of slides, or `rad or m` if the cell has both.
        duration_s: simulated time, settling included [s].
        moved_to_start: whether the arms were elsewhere, and were put at the start of the plan first.
        loads: arm name -> the joint with the largest torque relative to its rating.
        nearness: whether bodies came closer than the proof of the plan says.
        halts: when a monitor stopped the arms.
        times: recorded times [t] [s], one per physics step and the begin.
        positions: recorded configurations, arm name -> [t, dof] [rad, of slides m].
        phases: time of the plan at each recorded time [t] [s]; it differs from `times` only with a monitor.
    """

    reached: bool
    contacts: list[Contact]
    max_tracking_error_rad: float
    unit: str
    duration_s: float
    moved_to_start: bool
    loads: Mapping[str, PeakTorque]
    nearness: ClearanceAudit
    halts: list[Halt]
    times: Float[np.ndarray, "t"]
    positions: Mapping[str, Float[np.ndarray, "t dof"]]
    phases: Float[np.ndarray, "t"]

    @brief
    def __repr__(self) -> str:
        goals = "every goal reached" if self.reached else "not every goal reached"
        contacts = counted(len(self.contacts), "contact") if self.contacts else "no contact"
        largest = max(load.share for load in self.loads.values())
        # All torques are 0 only for joints that are placed on the plan, which have no actuator.
        torque = f", torque at most {largest:.0%} of its rating" if largest > 0 else ""
        halts = f", {counted(len(self.halts), 'halt')}" if self.halts else ""
        return (
            f"{goals}, {contacts}, tracking error at most {self.max_tracking_error_rad:.4f} {self.unit}"
            f"{torque}{halts}, {in_seconds(self.duration_s)}"
        )

    @property
    def given_up(self) -> bool:
        """Whether a monitor gave up the execution; the last of `halts` says why."""
        return bool(self.halts) and self.halts[-1].until_s is None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Played:
    """Positions after each physics step [t, n], the times of the plan then, the largest error, and the end [n]."""

    passed: Float[np.ndarray, "t n"]
    phases: Float[np.ndarray, "t"]
    error: float
    end: Float[np.ndarray, "n"]
    halts: list[Halt]


def execute_plan(
    simulation: Driven, plan: Plan, show: Callable[[], None] = lambda: None, monitor: Monitor | None = None
) -> ExecutionReport:
    """Plays `plan` from its start, and returns the report. Arms without a trajectory hold still.

    At every physics step the servos follow the positions of the plan, with its velocities as feed-forward. `Reference`
    defines both between the times of the plan.

    Args:
        simulation: the cell, with the arms at any configuration, or a user's model that has these arms.
        plan: a plan of the same cell.
        show: is called every 40 ms of simulated time.
        monitor: stops all arms when one of them lags.

    Raises:
        MmpError: for a plan of another cell, one that is malformed or longer than `LONGEST_EXECUTION_S`, or one that is
            not retimed if there is a monitor.
    """
    check_fit(plan, simulation.cell)
    check_duration(plan)
    standing = simulation.split(simulation.positions)
    start = {name: plan.positions[name][0] if name in plan.positions else standing[name] for name in standing}
    reference = Reference(plan, start)
    clock = PhaseClock(reference) if monitor is not None else None
    moved = any(np.abs(start[name] - standing[name]).max() > REACHED_RAD for name in standing)
    if moved:
        simulation.place(simulation.joined(start))
    begin = simulation.positions
    simulation.begin_log()
    if monitor is None or clock is None:
        played = _play(simulation, reference, show)
    else:
        played = _play_monitored(simulation, reference, clock, monitor, show)
    held, rest_error = _settle(simulation, played.end, show)
    recorded = np.concatenate([begin[None], played.passed, held])
    positions, end = simulation.split(recorded), simulation.split(recorded[-1])
    times = simulation.timestep_s * np.arange(len(recorded))
    return ExecutionReport(
        reached=all(np.abs(end[name] - plan.problem.goal[name]).max() <= REACHED_RAD for name in plan.positions),
        contacts=simulation.log.contacts,
        max_tracking_error_rad=max(played.error, rest_error),
        unit=simulation.cell.largest_unit,
        duration_s=float(times[-1]),
        moved_to_start=bool(moved),
        loads=peak_torques(simulation),
        nearness=audit_clearance(simulation, plan, times, positions),
        halts=played.halts,
        times=times,
        positions=positions,
        phases=np.pad(np.append(0.0, played.phases), (0, len(held)), mode="edge"),
    )


def _play(simulation: Driven, reference: Reference, show: Callable[[], None]) -> _Played:
    """Plays the reference to its end."""
    step_s = simulation.timestep_s
    count = int(np.ceil((reference.end_s - reference.start_s) / step_s - 1e-9))
    phases = reference.start_s + step_s * np.arange(count + 1)
    wanted, velocity = reference.at(phases)
    passed = np.empty((count, simulation.count))
    for first in range(0, count, SHOWN_STEPS):
        part = slice(first, min(first + SHOWN_STEPS, count))
        passed[part] = simulation.follow(wanted[part], velocity[part], wanted[part.stop])
        show()
    error = float(np.abs(passed - wanted[1:]).max(initial=0.0))
    played = phases[1:].clip(0.0, reference.times[-1])
    return _Played(passed=passed, phases=played, error=error, end=wanted[-1], halts=[])


def _play_monitored(
    simulation: Driven, reference: Reference, clock: PhaseClock, monitor: Monitor, show: Callable[[], None]
) -> _Played:
    """Plays the reference at the speed of the phase, until no joint lags at the end or the monitor gives up."""
    step_s, time_s = simulation.timestep_s, 0.0
    joints = [(name, k + 1) for name, part in simulation.slices.items() for k in range(part.stop - part.start)]
    run = MonitorRun(monitor, clock, joints)
    passed, phases, error = [], [], 0.0
    wanted, velocity = reference.at(np.array([clock.phase]))
    while not run.over:
        passed.append(simulation.follow(wanted, clock.speed * velocity)[0])
        clock.advance(step_s)
        time_s += step_s
        wanted, velocity = reference.at(np.array([clock.phase]))
        lag = np.abs(passed[-1] - wanted[0])
        error = max(error, float(lag.max()))
        phases.append(clock.plan_s)
        run.update(time_s, lag, step_s)
        if len(passed) % SHOWN_STEPS == 0:
            show()
    return _Played(
        passed=np.array(passed).reshape(-1, simulation.count),
        phases=np.array(phases),
        error=error,
        end=wanted[0],
        halts=run.halts,
    )


def _settle(
    simulation: Driven, end: Float[np.ndarray, "n"], show: Callable[[], None]
) -> tuple[Float[np.ndarray, "t n"], float]:
    """Returns the positions after each physics step while the servos hold `end`, and the largest error [rad]."""
    reference, passed = np.tile(end, (SHOWN_STEPS, 1)), []
    for _ in range(round(SETTLE_S / simulation.timestep_s / SHOWN_STEPS)):
        passed.append(simulation.follow(reference, np.zeros_like(reference)))
        show()
        near = np.abs(passed[-1][-1] - end).max() <= _SETTLED_RAD
        if near and np.abs(simulation.velocities).max() <= _SETTLED_RAD_S:
            break
    return np.concatenate(passed), float(np.abs(np.concatenate(passed) - end).max())
