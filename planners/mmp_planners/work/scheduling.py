"""`schedule`: plans all jobs of a cell, each arm in its own time, and proves the whole schedule."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.argument_checks import given, known_keywords, number, whole
from mmp_env.brief import brief
from mmp_env.errors import InvalidInstanceError
from mmp_env.files.writing import plain
from mmp_env.model.certificate import certify
from mmp_env.model.goals import Stay
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem
from mmp_env.problems.making import make_problem
from mmp_env.retime.limits import JointLimits, arm_limits
from mmp_env.work.jobs import Jobs
from mmp_env.work.order import order_of
from mmp_env.work.replay import Replay, replay, windows_of
from mmp_env.work.schedule import Schedule, WorkEvent, plan_of
from mmp_env.work.trajectory import PERIOD_S, time_of
from mmp_env.work.world import first_world
from mmp_planners import registry
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import GRID_STEP_S, LARGEST_SEED, check_steps
from mmp_planners.planner import Planner, Status, StopPlanning
from mmp_planners.work.commitment import Commitment
from mmp_planners.work.group import OPTIONS, Together
from mmp_planners.work.handling import Handling
from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.scheduler import Done, Scheduler
from mmp_planners.work.timeline import Timeline
from mmp_planners.work.timing import Timing
from mmp_planners.work.turns import OwnTime, Rounds
from mmp_planners.work.yielding import Yielding

SLACK_SHARES = (1.0, 0.25, 0.05)
"""Shares of the planning slack of the start that are tried, the next where goals of the jobs leave less room."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScheduleResult:
    """Result of `schedule`.

    Attributes:
        status: how the run ended.
        schedule: the proved schedule, or None unless the status is `solved`.
        blocked: names of the arms that could not go on.
        reason: why one of them could not, if that is known.
        stats: counts and times [s] of the run.
    """

    status: Status
    schedule: Schedule | None = None
    blocked: tuple[str, ...] = ()
    reason: str = ""
    stats: Mapping[str, Any] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        return f"{self.status}: {self.message if self.schedule is None else self.schedule}"

    @property
    def message(self) -> str:
        """A sentence on why there is no schedule; empty if there is one."""
        if self.schedule is not None:
            return ""
        if not self.blocked:
            return "no schedule was proved in time"
        arms = f"{'arm' if len(self.blocked) == 1 else 'arms'} {', '.join(self.blocked)}"
        why = " in time" if self.status is Status.TIMEOUT else ", although other arms were asked to yield"
        reason = f": {self.reason}" if self.reason else ""
        return f"no motion was found for the next step of {arms}{why}{reason}"


@known_keywords
def schedule(
    jobs: Jobs,
    *,
    planner: str = "auto",
    seed: int = 0,
    time_limit: float = math.inf,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float | Mapping[str, float] | Margins | None = None,
    max_acceleration: JointLimits = None,
    max_jerk: JointLimits = None,
    rounds: bool = False,
) -> ScheduleResult:
    """Plans all jobs, each arm in its own time.

    Args:
        jobs: the work, such as `mmp_env.load_jobs` gives.
        planner: name of the planner of all arms together, for where no single arm can go on.
        seed: seed of all random numbers. The same seed gives the same schedule, unless the time limit is hit.
        time_limit: time limit [s].
        max_velocity: [rad/s] for all joints, or arm name -> [dof]; a robot's own limit holds as well.
        margin: clearances [m], as in `make_problem`.
        max_acceleration: [rad/s^2] for all joints, or arm name -> [dof]; None for the robots' own limits.
        max_jerk: [rad/s^3], like `max_acceleration`.
        rounds: in each round every arm moves once, and the next round begins when all have arrived; for comparisons.

    Raises:
        MmpError: if an argument is not allowed.
        InvalidInstanceError: for a start in collision, and a job that no arm can do.
    """
    given("jobs", jobs, Jobs, "Jobs, such as load_jobs gives")
    seed = whole("seed", seed, 0, LARGEST_SEED)
    limit = number("time_limit", time_limit, "a number of seconds, 0 or more, inf for none", zero=True, infinite=True)
    of_group = registry.make(planner, **OPTIONS.get(planner, {}))
    began = time.perf_counter()
    clock = core.Clock(min(limit, 1e10))
    stay = dict.fromkeys(jobs.cell.arm_names, Stay())
    world = first_world(jobs.cell, jobs.objects)
    problem = make_problem(world.filled, jobs.start, stay, max_velocity=max_velocity, margin=margin, name=jobs.name)
    check_steps(problem, GRID_STEP_S)
    slack, problem = problem.slack, dataclasses.replace(problem, cell=jobs.cell)
    handling = Handling(problem, world, jobs.jobs)
    limits = {
        "max_acceleration": arm_limits(jobs.cell, max_acceleration, "acceleration"),
        "max_jerk": arm_limits(jobs.cell, max_jerk, "jerk"),
    }
    setup = _Setup(
        jobs=jobs,
        handling=handling,
        timing=Timing(handling, PERIOD_S, **limits),
        planner_name=planner,
        planner=of_group,
        seed=seed,
        clock=clock,
        rounds=rounds,
    )
    scheduler, timeline, counts = setup.with_room(slack)
    try:
        complete = scheduler.run()
    except StopPlanning:
        complete = False
    found = _proved(jobs, problem, limits, scheduler, timeline, clock) if complete else None
    stats: dict[str, Any] = counts() | {"planning_time_s": time.perf_counter() - began}
    if found is None:
        stopped = clock.expired or not scheduler.blocked
        status = Status.TIMEOUT if stopped else Status.EXHAUSTED
        return ScheduleResult(status=status, blocked=scheduler.blocked, reason=scheduler.reason, stats=stats)
    signature = {"name": planner, "options": _options(of_group), "seed": seed}
    found = dataclasses.replace(found, planner=signature, stats=counts())
    stats["makespan_s"] = found.makespan_s
    if isinstance(scheduler.turns, Rounds):
        stats["round_begins_s"] = [time_of(begin, timeline.period_s) for begin in scheduler.turns.begins]
    return ScheduleResult(status=Status.SOLVED, schedule=found, stats=stats)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Setup:
    """The parts of a run that do not depend on the slack."""

    jobs: Jobs
    handling: Handling
    timing: Timing
    planner_name: str
    planner: Planner
    seed: int
    clock: core.Clock
    rounds: bool

    def with_room(self, slack: float) -> tuple[Scheduler, Timeline, Callable[[], dict[str, Any]]]:
        """Returns `begin` with as much slack as the goals of the jobs leave. Raises `InvalidInstanceError`."""
        for share in SLACK_SHARES[:-1]:
            with contextlib.suppress(InvalidInstanceError):  # a goal is tight
                return self.begin(share * slack)
        return self.begin(SLACK_SHARES[-1] * slack)

    def begin(self, slack: float) -> tuple[Scheduler, Timeline, Callable[[], dict[str, Any]]]:
        """Returns a scheduler about to begin, its timeline, and a function that returns its counts."""
        mover = MovePlanner(self.handling, slack, GRID_STEP_S, SiRrtStar(), self.seed, self.clock)
        timeline = Timeline(self.handling, _distance(self.jobs, self.handling.bare), PERIOD_S)
        commitment = Commitment(timeline, self.timing, mover)
        yielding = Yielding(mover, timeline, commitment, self.seed)
        together = Together(self.planner_name, self.planner, timeline, self.timing, yielding)
        scheduler = Scheduler(
            jobs=self.jobs,
            mover=mover,
            handling=self.handling,
            timeline=timeline,
            commitment=commitment,
            yielding=yielding,
            together=together,
            turns=Rounds(timeline) if self.rounds else OwnTime(),
            seed=self.seed,
        )

        def counts() -> dict[str, Any]:
            return {"low_level_calls": mover.calls, "yields": scheduler.yields, "group_plans": together.plans}

        return scheduler, timeline, counts


def _proved(
    jobs: Jobs,
    problem: Problem,
    limits: Mapping[str, Mapping[str, Any]],
    scheduler: Scheduler,
    timeline: Timeline,
    clock: core.Clock,
) -> Schedule | None:
    """Returns the schedule with its proof, or None if the proof does not end in time."""
    trajectories = timeline.trajectories()
    plan = plan_of(problem, trajectories)
    place = {name: k for k, name in enumerate(timeline.names)}
    events = sorted(
        (_event(done, timeline) for done in scheduler.done),
        key=lambda event: (event.begin_s, place[event.arm], event.end_s),
    )
    found = replay(problem.cell, jobs, trajectories, events)
    proof = _proof(plan, found, clock)
    if proof is None:
        return None
    return Schedule(
        jobs=jobs,
        problem=plan.problem,
        **limits,
        trajectories=trajectories,
        events=tuple(events),
        order=order_of(problem.cell, jobs, trajectories, events, _distance(jobs, problem), found),
        proof=proof,
    )


def _proof(plan: Plan, found: Replay, clock: core.Clock) -> Margins | None:
    """Returns the clearances that are proved in all windows, with the objects of each; None if a proof fails."""
    proofs = [certify(part, clock) for part in windows_of(plan, found)]
    if not all(proof.valid for proof in proofs):
        return None
    return Margins(**{kind: min(proof.proved[kind] for proof in proofs) for kind in KINDS})


def _distance(jobs: Jobs, problem: Problem) -> float:
    """Returns the clearance between arms at any times [m]; also that to obstacles, since objects are both."""
    margins = problem.margins
    return max(margins.arms, margins.obstacles) if jobs.objects else margins.arms


def _event(done: Done, timeline: Timeline) -> WorkEvent:
    return WorkEvent(
        begin_s=time_of(done.begin, timeline.period_s),
        end_s=time_of(done.end, timeline.period_s),
        arm=timeline.names[done.arm],
        kind=done.kind,
        job=None if done.state is None else done.state.job.name,
        step=done.step,
        group=done.group,
        solid=done.solid,
    )


def _options(planner: Planner) -> dict[str, Any]:
    return plain(dataclasses.asdict(planner)) if dataclasses.is_dataclass(planner) else {}
