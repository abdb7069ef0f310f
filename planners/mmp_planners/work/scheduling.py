"""`schedule`: plans all jobs of a cell, each arm in its own time, and proves the whole schedule."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.argument_checks import flag, given, known_keywords, number, whole
from mmp_env.brief import brief
from mmp_env.errors import InvalidInstanceError, MmpError
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
from mmp_env.work.world import World, first_world
from mmp_planners import registry
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import GRID_STEP_S, LARGEST_SEED, check_steps
from mmp_planners.planner import Planner, Status, StopPlanning
from mmp_planners.work.commitment import Commitment
from mmp_planners.work.group import OPTIONS, Together
from mmp_planners.work.handling import Handling
from mmp_planners.work.improvement import improved
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
    improve: float = 0.0,
    watch: Callable[[Schedule], None] | None = None,
) -> ScheduleResult:
    """Plans all jobs, each arm in its own time.

    Args:
        jobs: the work, such as `mmp_env.load_jobs` gives.
        planner: name of the planner of all arms together, for where no single arm can go on.
        seed: seed of all random numbers. The same seed gives the same schedule, unless the time limit is hit.
        time_limit: time limit [s].
        max_velocity: [rad/s] for all joints, or arm name -> a number or [dof]; a robot's own limit holds as well.
        margin: clearances [m], as in `make_problem`.
        max_acceleration: [rad/s^2] for all joints, or arm name -> a number or [dof]; None for the robots' own limits.
        max_jerk: [rad/s^3], like `max_acceleration`.
        rounds: in each round every arm moves once, and the next round begins when all have arrived; for comparisons.
        improve: time [s] for improving the first schedule, within `time_limit`: a few jobs get other arms, or come
            earlier or later, and the schedule with the shortest makespan is kept.
        watch: called with the first schedule, and with each one that is shorter than those before.

    Raises:
        MmpError: if an argument is not allowed.
        InvalidInstanceError: for a start in collision, and a job that no arm can do.
    """
    given("jobs", jobs, Jobs, "Jobs, such as load_jobs gives")
    seed = whole("seed", seed, 0, LARGEST_SEED)
    limit = number("time_limit", time_limit, "a number of seconds, 0 or more, inf for none", zero=True, infinite=True)
    improve = number("improve", improve, "a number of seconds, 0 or more", zero=True)
    if improve > limit:
        raise MmpError(f"improve is {improve:g} s; it must be at most the time limit of {limit:g} s, which ends it")
    rounds = flag("rounds", rounds)
    of_group = registry.make(planner, **OPTIONS.get(planner, {}))
    began = time.perf_counter()
    clock = core.Clock(min(limit, 1e10))
    stay = dict.fromkeys(jobs.cell.arm_names, Stay())
    world = first_world(jobs.cell, jobs.objects)
    problem = make_problem(world.filled, jobs.start, stay, max_velocity=max_velocity, margin=margin, name=jobs.name)
    check_steps(problem, GRID_STEP_S)
    slack, problem = problem.slack, dataclasses.replace(problem, cell=jobs.cell)
    setup = _Setup(
        jobs=jobs,
        problem=problem,
        world=world,
        slack=slack,
        limits={
            "max_acceleration": arm_limits(jobs.cell, max_acceleration, "acceleration"),
            "max_jerk": arm_limits(jobs.cell, max_jerk, "jerk"),
        },
        planner_name=planner,
        planner=of_group,
        seed=seed,
        rounds=rounds,
    )
    first = setup.attempt(jobs, clock)
    stats = first.stats | {"planning_time_s": time.perf_counter() - began}
    found = first.schedule
    if found is None:
        stopped = clock.expired or not first.blocked
        status = Status.TIMEOUT if stopped else Status.EXHAUSTED
        return ScheduleResult(status=status, blocked=first.blocked, reason=first.reason, stats=stats)
    watch = watch or (lambda _: None)
    watch(found)
    if improve:
        until = core.Clock(max(0.0, min(improve, limit - (time.perf_counter() - began))))
        stats["first_makespan_s"] = found.makespan_s
        attempt = partial(setup.attempt_or_none, clock=until)
        found, stats["attempts"] = improved(jobs, found, attempt, seed, until, watch)
    stats["makespan_s"] = found.makespan_s
    return ScheduleResult(status=Status.SOLVED, schedule=found, stats=stats)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Attempt:
    """Result of planning jobs in one order: a proved schedule, or None and the names of blocked arms."""

    schedule: Schedule | None
    blocked: tuple[str, ...]
    reason: str
    stats: dict[str, Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Setup:
    """All that does not depend on the order of the jobs."""

    jobs: Jobs
    problem: Problem
    world: World
    slack: float
    limits: Mapping[str, Mapping[str, Any]]
    planner_name: str
    planner: Planner
    seed: int
    rounds: bool

    def attempt(self, work: Jobs, clock: core.Clock) -> _Attempt:
        """Plans the jobs in the order of `work` and with its arms. Raises `InvalidInstanceError`.

        If the proof of the schedule fails, plans again and proves each motion when it is timed, which takes longer.
        """
        first = self._attempt(work, clock, prove_each=False)
        failed = first.schedule is None and not first.blocked and not clock.expired
        return self._attempt(work, clock, prove_each=True) if failed else first

    def _attempt(self, work: Jobs, clock: core.Clock, *, prove_each: bool) -> _Attempt:
        scheduler, timeline, counts = self._with_room(work, clock, prove_each)
        try:
            complete = scheduler.run()
        except StopPlanning:
            complete = False
        found = _proved(self.jobs, self.problem, self.limits, scheduler, timeline, clock) if complete else None
        stats: dict[str, Any] = counts()
        if found is not None:
            signature = {"name": self.planner_name, "options": _options(self.planner), "seed": self.seed}
            found = dataclasses.replace(found, planner=signature, stats=counts())
        if isinstance(scheduler.turns, Rounds):
            stats["round_begins_s"] = [time_of(begin, timeline.period_s) for begin in scheduler.turns.begins]
        return _Attempt(schedule=found, blocked=scheduler.blocked, reason=scheduler.reason, stats=stats)

    def attempt_or_none(self, work: Jobs, clock: core.Clock) -> Schedule | None:
        """Returns the schedule of `attempt`; None if there is none, or if a job is impossible in that order."""
        try:
            return self.attempt(work, clock).schedule
        except InvalidInstanceError:
            return None

    def _with_room(
        self, work: Jobs, clock: core.Clock, prove_each: bool
    ) -> tuple[Scheduler, Timeline, Callable[[], dict[str, Any]]]:
        """Returns `_begin` with as much slack as the goals of the jobs leave. Raises `InvalidInstanceError`."""
        for share in SLACK_SHARES[:-1]:
            with contextlib.suppress(InvalidInstanceError):  # a goal is tight
                return self._begin(work, share * self.slack, clock, prove_each)
        return self._begin(work, SLACK_SHARES[-1] * self.slack, clock, prove_each)

    def _begin(
        self, work: Jobs, slack: float, clock: core.Clock, prove_each: bool
    ) -> tuple[Scheduler, Timeline, Callable[[], dict[str, Any]]]:
        """Returns a scheduler about to begin, its timeline, and a function that returns its counts."""
        handling = Handling(self.problem, self.world, work.jobs)
        timing = Timing(handling, PERIOD_S, **self.limits)
        mover = MovePlanner(handling, slack, GRID_STEP_S, SiRrtStar(), self.seed, clock)
        timeline = Timeline(handling, _distance(work, self.problem), PERIOD_S)
        commitment = Commitment(timeline, timing, None if prove_each else mover)
        yielding = Yielding(mover, timeline, commitment, self.seed)
        together = Together(self.planner_name, self.planner, timeline, timing, yielding)
        scheduler = Scheduler(
            jobs=work,
            mover=mover,
            handling=handling,
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
