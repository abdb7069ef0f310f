"""Asynchronous scheduling: the arm that becomes free first plans its next motion against all committed motions.

Motions with the rests after them are clear of each other, so an arm that finds no path waits without harm until others
have moved on. When no arm can go on, arms in the way yield; if that does not help, all arms are planned together from
rest. Either ends a step of a job, so the scheduler ends: there is no livelock.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.errors import InvalidInstanceError
from mmp_env.model.goals import AnyOf, Goal, JointGoal, Stay
from mmp_env.work.jobs import Jobs, Line, Move, Wait
from mmp_env.work.schedule import EventKind
from mmp_planners.seeds import quick_seed_of
from mmp_planners.work.commitment import Commitment, Proposal
from mmp_planners.work.dispatch import Dispatch, JobState, Option
from mmp_planners.work.group import Together
from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.step_paths import StepPaths, lines_after
from mmp_planners.work.timeline import Timeline
from mmp_planners.work.yielding import Yielding

BUDGETS = (0.1, 0.2)
"""Iteration budgets of the searches for a path of an arm before it waits for others to move on."""
LAST_BUDGETS = (1.0, 2.0)
"""Iteration budgets of the searches when no arm can go on."""
WORTH_A_DETOUR = 10
"""Wait of an arm [periods] from which on a path around all that the others have still to do is tried."""
DETOUR_BUDGET = 0.1
"""Iteration budget of such a search."""
LINE_ROUNDING_RAD = 1e-3
"""Largest distance of a joint from the path of a line at its rounded corners [rad, of slides m]."""
LINE_SPEED = 0.3
"""Speed of a line for estimates of who is done first [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Done:
    """What an arm does between two periods; `state` and `step` are None if it yields. `group`: number of its group."""

    begin: int
    end: int
    arm: int
    kind: EventKind
    state: JobState | None = None
    step: int | None = None
    group: int | None = None


class Scheduler:
    """One run.

    Args:
        jobs: the work.
        mover: plans single arms.
        timeline: the committed motions.
        commitment: commits motions.
        yielding: moves arms aside.
        together: plans all arms.
        seed: seed of the plans of groups.

    Attributes:
        done: what the arms do, in the order of planning.
        yields: number of motions aside.
        blocked: names of the arms that could not go on, in the end.
    """

    def __init__(
        self,
        *,
        jobs: Jobs,
        mover: MovePlanner,
        timeline: Timeline,
        commitment: Commitment,
        yielding: Yielding,
        together: Together,
        seed: int,
    ) -> None:
        self._jobs, self._mover, self._timeline, self._commitment = jobs, mover, timeline, commitment
        self._paths = StepPaths(mover)
        self._yielding, self._together, self._seed = yielding, together, seed
        self._known: dict[tuple[int, int, int], Float[np.ndarray, "n dof"] | None] = {}
        self._tried: dict[int, int] = {}
        self.done: list[Done] = []
        self.yields = 0
        self.blocked: tuple[str, ...] = ()
        self._dispatch = Dispatch(jobs, self._finish, timeline.end)
        self._check()

    def run(self) -> bool:
        """Plans all jobs. Returns whether it could."""
        while options := self._dispatch.options():
            if self._mover.clock.expired:
                return self._stuck(options)
            open_ones = [option for option in options if self._tried.get(option.arm) != self._timeline.version]
            if open_ones:
                self._go_on(open_ones[0], options)
            elif not (
                any(self._moves(option, LAST_BUDGETS) for option in options)
                or self._yield_for(options)
                or self._move_together(options)
            ):
                return self._stuck(options)
        return True

    def _go_on(self, option: Option, options: Sequence[Option]) -> None:
        """Does the next step of an arm, or notes that it cannot at present. Arms without work yield at once."""
        idle = set(range(len(self._timeline.names))) - {other.arm for other in options}
        step = option.state.next_step
        self._timeline.wait(option.arm, option.begin)
        if isinstance(step, Wait):
            self._timeline.wait(option.arm, option.begin + math.ceil(step.seconds / self._timeline.period_s - 1e-9))
            self._advance(option, "wait", option.begin)
        elif not (self._moves(option) or (idle and self._make_way(option, idle))):
            self._tried[option.arm] = self._timeline.version

    def _moves(self, option: Option, budgets: Sequence[float] = BUDGETS) -> bool:
        """Does the move or line of an arm, if there is a path among the places where the others stand in the end."""
        motion = self._motion(option, budgets)
        if motion is None:
            return False
        self._commitment.commit(motion)
        self._advance(option, "line" if isinstance(option.state.next_step, Line) else "move", motion.begin)
        return True

    def _motion(self, option: Option, budgets: Sequence[float]) -> Proposal | None:
        arm, timeline = option.arm, self._timeline
        rests = timeline.rests([arm])
        if isinstance(option.state.next_step, Line):
            path = self._path(option, rests, 1.0)
            return None if path is None else self._commitment.propose(arm, path, LINE_ROUNDING_RAD)
        for budget in budgets:
            path = self._path(option, rests, budget)
            motion = None if path is None else self._commitment.propose(arm, path)
            if motion is None:
                continue
            if motion.begin - timeline.end(arm) >= WORTH_A_DETOUR:
                path = self._path(option, timeline.volumes([arm]), DETOUR_BUDGET)
                detour = None if path is None else self._commitment.propose(arm, path)
                if detour is not None and detour.end < motion.end:
                    return detour
            return motion
        return None

    def _path(self, option: Option, others: Sequence[core.Motion], budget: float) -> Float[np.ndarray, "k dof"] | None:
        """Returns a path of the next step of an arm, clear of other arms that stand still; or None."""
        arm, state, start = option.arm, option.state, self._timeline.rest(option.arm)
        where = _where(state, state.step)
        if isinstance(state.next_step, Line):
            path = self._paths.line(arm, start, state.next_step, where)
            return None if self._mover.in_the_way(arm, path, others) else path
        ends = self._paths.ends(arm, state.left, start, where)
        clear = self._paths.clear_of(arm, ends, state.left, others)
        return self._mover.plan(arm, start, clear, others, budget) if len(clear) else None

    def _yield_for(self, options: Sequence[Option]) -> bool:
        """Lets any arms yield for the first blocked arm that this helps."""
        everyone = range(len(self._timeline.names))
        return any(self._make_way(option, [b for b in everyone if b != option.arm]) for option in options)

    def _make_way(self, option: Option, may_yield: Collection[int]) -> bool:
        """Lets arms yield, and then moves the arm for which they do; otherwise takes that back."""
        arm, before = option.arm, self._timeline.snapshot()
        asked = sorted(set(may_yield) - self._dispatch.pinned)
        path = self._path(option, self._timeline.rests([arm, *asked]), 1.0) if asked else None
        if path is None:
            return False
        whole = self._paths.along_lines(arm, path[-1], lines_after(option.state.left), "")
        asides = self._yielding.make_way(arm, np.concatenate([path, whole[1:]]), asked)
        if not asides or not self._moves(option):
            self._timeline.restore(before)
            return False
        self.yields += len(asides)
        self.done += [Done(begin=each.begin, end=each.end, arm=each.arm, kind="yield") for each in asides]
        return True

    def _move_together(self, options: Sequence[Option]) -> bool:
        """Plans all arms together: all blocked arms to their goals, or else one of them."""
        blocked = {option.arm: option for option in options if isinstance(option.state.next_step, Move)}
        groups = [blocked, *({arm: option} for arm, option in blocked.items())] if len(blocked) > 1 else [blocked]
        return any(self._move_group(group) for group in groups if group)

    def _move_group(self, group: dict[int, Option]) -> bool:
        timeline, seed = self._timeline, quick_seed_of(self._seed, self._together.plans)
        goals: dict[int, Goal] = {arm: Stay() for arm in self._dispatch.pinned}
        for arm, option in group.items():
            steps, where = option.state.left, _where(option.state, option.state.step)
            ends = self._paths.ends(arm, steps, timeline.rest(arm), where)
            goals[arm] = AnyOf([JointGoal(q) for q in ends])
        begin = self._together.move(goals, seed, self._mover.clock.remaining)
        if begin is None:
            return False
        number = self._together.plans
        for arm in range(len(timeline.names)):
            if arm in group:
                self._advance(group[arm], "move", begin, number)
            else:
                self.done.append(Done(begin=begin, end=timeline.end(arm), arm=arm, kind="yield", group=number))
        return True

    def _advance(self, option: Option, kind: EventKind, begin: int, group: int | None = None) -> None:
        state, end = option.state, self._timeline.end(option.arm)
        done = Done(begin=begin, end=end, arm=option.arm, kind=kind, state=state, step=state.step, group=group)
        self.done.append(done)
        self._dispatch.advance(option)

    def _stuck(self, options: Sequence[Option]) -> bool:
        names = self._timeline.names
        self.blocked = tuple(names[arm] for arm in sorted({option.arm for option in options}))
        return False

    def _known_goals(self, state: JobState, step: int, arm: int) -> Float[np.ndarray, "n dof"] | None:
        """Returns the goals of a step as seen from the start; None if the arm has none."""
        key = state.number, step, arm
        if key not in self._known:
            try:
                self._known[key] = self._first_goals(state, step, arm)
            except InvalidInstanceError:
                self._known[key] = None
        return self._known[key]

    def _first_goals(self, state: JobState, step: int, arm: int) -> Float[np.ndarray, "n dof"]:
        start = self._mover.problem.start[self._timeline.names[arm]]
        return self._paths.ends(arm, state.job.steps[step:], start, _where(state, step), most=1)

    def _finish(self, state: JobState, arm: int, begin: int) -> float:
        """Returns about when an arm would be done with a job; infinity if it cannot do it [periods]."""
        at, speed = self._timeline.rest(arm), self._mover.problem.max_velocity[self._timeline.names[arm]]
        when = float(begin)
        for k, step in list(enumerate(state.job.steps))[state.step :]:
            if not isinstance(step, Move):
                lasting = step.seconds if isinstance(step, Wait) else float(np.linalg.norm(step.by)) / LINE_SPEED
                when += lasting / self._timeline.period_s
                continue
            rows = self._known_goals(state, k, arm)
            if rows is None:
                return math.inf
            durations = (np.abs(rows - at) / speed).max(axis=1)
            when, at = when + float(durations.min()) / self._timeline.period_s, rows[int(durations.argmin())]
        return when

    def _check(self) -> None:
        """Raises `InvalidInstanceError` for a job that no arm, or not its arm, can do."""
        for state in self._dispatch.states:
            moves = [k for k, step in enumerate(state.job.steps) if isinstance(step, Move)]
            arms = range(len(self._timeline.names)) if state.arm is None else [state.arm]
            if any(all(self._known_goals(state, k, arm) is not None for k in moves) for arm in arms):
                continue
            reasons = list(self._reasons(state, moves, arms))
            more = "" if state.arm is not None else "; no other arm can do the job either"
            raise InvalidInstanceError(reasons[0] + more)

    def _reasons(self, state: JobState, moves: Sequence[int], arms: Sequence[int]) -> Iterator[str]:
        for arm in arms:
            for step in moves:
                try:
                    self._first_goals(state, step, arm)
                except InvalidInstanceError as error:
                    yield str(error)


def _where(state: JobState, step: int) -> str:
    return f"step {step} of job '{state.job.name}'"
