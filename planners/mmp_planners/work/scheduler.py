"""Asynchronous scheduling: the arm that becomes free first plans its next motion against all committed motions.

Motions with the rests after them are clear of each other, so an arm that finds no path waits without harm until others
have moved on. When no arm can go on, arms that block others yield; if that does not help, all arms are planned together
from rest. Either ends a step of a job, so the scheduler ends: there is no livelock.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from mmp_env.errors import InvalidInstanceError
from mmp_env.model.arm import Obstacle
from mmp_env.model.goals import AnyOf, Goal, JointGoal, Stay
from mmp_env.work.jobs import Jobs, Line, Move, Wait
from mmp_env.work.object_steps import Grasp, Release
from mmp_env.work.schedule import EventKind
from mmp_planners.seeds import quick_seed_of
from mmp_planners.work.commitment import Commitment, Proposal
from mmp_planners.work.dispatch import Dispatch, JobState, Option
from mmp_planners.work.estimates import Estimates
from mmp_planners.work.group import Together
from mmp_planners.work.handling import Handling, Stop, first_object_step, stop_at
from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.step_paths import FEW_ENDS, MOST_ENDS, End, Others, StepPaths, refuse_sinking, where_of
from mmp_planners.work.timeline import Timeline
from mmp_planners.work.timing import TOLERANCE_RAD
from mmp_planners.work.turns import Turns
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


@dataclass(frozen=True, kw_only=True)
class Done:
    """An event of an arm between two periods; `state` and `step` are None if it yields. `group`: its group."""

    begin: int
    end: int
    arm: int
    kind: EventKind
    state: JobState | None = None
    step: int | None = None
    group: int | None = None
    solid: Obstacle | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class StepPath:
    """The path of a step [k, dof], the stop at its end, and the paths of the lines after it."""

    path: Float[np.ndarray, "k dof"]
    stop: Stop
    lines: tuple[Float[np.ndarray, "_ dof"], ...] = ()

    @property
    def whole(self) -> Float[np.ndarray, "k dof"]:
        """The path with those of the lines."""
        return np.concatenate([self.path, *(line[1:] for line in self.lines)])


class Scheduler:
    """One run.

    Args:
        jobs: the work.
        mover: plans single arms.
        handling: the objects.
        timeline: the committed motions.
        commitment: commits motions.
        yielding: moves arms aside.
        together: plans all arms.
        turns: decides which arms may go on.
        seed: seed of the plans of groups.

    Attributes:
        turns: see above.
        done: the events of all arms, in the order of planning.
        yields: number of motions aside.
        blocked: names of the arms that could not go on, in the end.
        reason: why the first of them could not, if that is known.
    """

    def __init__(
        self,
        *,
        jobs: Jobs,
        mover: MovePlanner,
        handling: Handling,
        timeline: Timeline,
        commitment: Commitment,
        yielding: Yielding,
        together: Together,
        turns: Turns,
        seed: int,
    ) -> None:
        self._jobs, self._mover, self._timeline, self._commitment = jobs, mover, timeline, commitment
        self._handling, self._paths = handling, StepPaths(mover, handling)
        self._yielding, self._together, self.turns, self._seed = yielding, together, turns, seed
        self._tried: dict[int, int] = {}
        self._why: dict[int, str] = {}
        self.done: list[Done] = []
        self.yields = 0
        self.blocked: tuple[str, ...] = ()
        self.reason = ""
        estimates = Estimates(mover, handling, self._paths, timeline)
        self._dispatch = Dispatch(jobs, estimates.finish, timeline.end, self._may_begin)
        estimates.check(self._dispatch.states)

    def run(self) -> bool:
        """Plans all jobs. Returns whether it could."""
        while options := self._dispatch.options():
            if self._mover.clock.expired:
                return self._stuck(options)
            admitted = self.turns.admitted(options)
            open_ones = [option for option in admitted if self._tried.get(option.arm) != self._timeline.version]
            if open_ones:
                self._go_on(open_ones[0], options)
            elif not self.turns.next_round() and not (
                any(self._moves(option, LAST_BUDGETS) for option in options)
                or self._yield_for(options)
                or self._move_together(options)
            ):
                self._refuse_impossible(options)
                return self._stuck(options)
        self._refuse_full_gripper()
        return True

    def _go_on(self, option: Option, options: Sequence[Option]) -> None:
        """Does the next step of an arm, or notes that it cannot at present. Arms without work yield at once."""
        idle = set(range(len(self._timeline.names))) - {other.arm for other in options}
        step = option.state.next_step
        self._timeline.wait(option.arm, option.begin)
        if isinstance(step, Wait):
            self._timeline.wait(option.arm, option.begin + math.ceil(step.seconds / self._timeline.period_s - 1e-9))
            self._advance(option, "wait", option.begin)
        elif isinstance(step, Grasp | Release):
            if not self._handle(option):
                self._tried[option.arm] = self._timeline.version
        elif not (self._moves(option) or (idle and self._let_yield(option, idle))):
            self._tried[option.arm] = self._timeline.version

    def _handle(self, option: Option) -> bool:
        """Grasps or releases an object, if that is possible after what is committed."""
        arm, state = option.arm, option.state
        of, job, step = self._jobs.cell.arms[arm], state.job, state.next_step
        assert isinstance(step, Grasp | Release)
        self._handling.look()
        try:
            stop = stop_at(self._handling.world, of, self._timeline.rest(arm), job, state.step, most=1)
        except InvalidInstanceError as error:
            self._why[arm] = str(error)
            return False
        names = stop.world.concerned(step.object)
        self._timeline.wait(arm, self._handling.used_until(names))
        begin = self._timeline.hand(arm, stop.world.held.get(of.name))
        if begin is None:
            return False
        grasps = isinstance(step, Grasp)
        solid = self._handling.world.lying[step.object] if grasps else stop.world.lying[step.object]
        self._handling.handled(of, stop, names, self._timeline.end(arm))
        self._advance(option, "grasp" if grasps else "release", begin, solid=solid)
        return True

    def _moves(self, option: Option, budgets: Sequence[float] = BUDGETS) -> bool:
        """Does the move or line of an arm, if there is a path among the places where the others stand in the end."""
        found = None if option.state.handles else self._motion(option, budgets)
        if found is None:
            return False
        path, motion = found
        self._commitment.commit(motion)
        if len(motion.samples):
            self._handling.arrived(self._jobs.cell.arms[option.arm], path.stop.before)
        self._advance(option, "line" if isinstance(option.state.next_step, Line) else "move", motion.begin)
        return True

    def _motion(self, option: Option, budgets: Sequence[float]) -> tuple[StepPath, Proposal] | None:
        """Returns a path of the next step of an arm, and the motion along it; None if there is none."""
        arm, timeline = option.arm, self._timeline
        for budget in budgets[:1] if isinstance(option.state.next_step, Line) else budgets:
            found = self._proposal(option, partial(timeline.rests, [arm]), budget)
            if found is None:
                continue
            begin, end = found[1].begin, found[1].end
            if begin - timeline.end(arm) >= WORTH_A_DETOUR and isinstance(option.state.next_step, Move):
                detour = self._proposal(option, partial(timeline.volumes, [arm]), DETOUR_BUDGET)
                if detour is not None and detour[1].end < end:
                    return detour
            return found
        return None

    def _proposal(self, option: Option, others: Others, budget: float) -> tuple[StepPath, Proposal] | None:
        path = self._path(option, others, budget)
        if path is None:
            return None
        self._handling.look({option.arm: path.stop.before})
        tolerance = LINE_ROUNDING_RAD if isinstance(option.state.next_step, Line) else TOLERANCE_RAD
        motion = self._commitment.propose(option.arm, path.path, tolerance)
        return None if motion is None else (path, motion)

    def _path(self, option: Option, others: Others, budget: float) -> StepPath | None:
        """Returns a path of the next step of an arm, clear of other arms that stand still; or None."""
        try:
            return self._found(option, others, budget)
        except InvalidInstanceError as error:
            self._why[option.arm] = str(error)
            return None

    def _found(self, option: Option, others: Others, budget: float) -> StepPath | None:
        arm, state, start = option.arm, option.state, self._timeline.rest(option.arm)
        job, of = state.job, self._jobs.cell.arms[arm]
        self._handling.look()
        if isinstance(state.next_step, Line):
            resting = self._handling.resting(of)
            line = self._paths.line(arm, start, job, state.step, self._handling.world, resting)
            clear = self._paths.is_clear(arm, line, others)
            return StepPath(path=line.path, stop=line.stop) if clear else None
        most = FEW_ENDS if budget <= BUDGETS[0] else MOST_ENDS
        ends = self._paths.ends(arm, job, state.step, start, most)
        ends = self._paths.clear_of(arm, ends, others)
        if not ends:
            return None
        self._handling.look({arm: frozenset().union(*(end.stop.before for end in ends))})
        path = self._mover.plan(arm, start, np.array([end.q for end in ends]), others(), budget)
        if path is None:
            return None
        end = min(ends, key=lambda end: float(np.abs(end.q - path[-1]).max()))
        refuse_sinking(self._handling.world, of, path, self._handling.resting(of), end.stop, where_of(job, state.step))
        return StepPath(path=path, stop=end.stop, lines=tuple(line.path for line in end.lines))

    def _yield_for(self, options: Sequence[Option]) -> bool:
        """Lets any arms yield for the first blocked arm that this helps."""
        everyone = range(len(self._timeline.names))
        return any(self._let_yield(option, [b for b in everyone if b != option.arm]) for option in options)

    def _let_yield(self, option: Option, may_yield: Collection[int]) -> bool:
        """Lets arms yield, and then moves the arm for which they do; otherwise takes that back."""
        arm, before = option.arm, self._timeline.snapshot()
        asked = sorted(set(may_yield) - self._pinned)
        others = partial(self._timeline.rests, [arm, *asked])
        found = self._path(option, others, 1.0) if asked and not option.state.handles else None
        if found is None:
            return False
        asides = self._yielding.clear_path(arm, found.whole, asked)
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
        goals: dict[int, Goal] = {arm: Stay() for arm in self._pinned}
        stops: dict[int, list[End]] = {}
        for arm, option in group.items():
            self._handling.look()
            try:
                stops[arm] = self._paths.ends(arm, option.state.job, option.state.step, timeline.rest(arm))
            except InvalidInstanceError as error:
                self._why[arm] = str(error)
                return False
            goals[arm] = AnyOf([JointGoal(end.q) for end in stops[arm]])
        before = {arm: frozenset().union(*(end.stop.before for end in ends)) for arm, ends in stops.items()}
        if self._handling.touching & set(group) or any(before.values()):
            return False  # the rules of objects that are taken or put down are those of single arms
        self._handling.look()
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

    def _advance(
        self, option: Option, kind: EventKind, begin: int, group: int | None = None, solid: Obstacle | None = None
    ) -> None:
        state, arm, end = option.state, option.arm, self._timeline.end(option.arm)
        done = Done(begin=begin, end=end, arm=arm, kind=kind, state=state, step=state.step, group=group, solid=solid)
        self.done.append(done)
        self._why.pop(arm, None)
        self.turns.taken(option)
        self._dispatch.advance(option)

    @property
    def _pinned(self) -> set[int]:
        """Arms that must stay where they are until their next step, also because they touch an object."""
        return self._dispatch.pinned | self._handling.touching

    def _may_begin(self, state: JobState, arm: int) -> bool:
        first = first_object_step(state.job)
        return not isinstance(first, Grasp) or self._handling.held(self._jobs.cell.arms[arm]) is None

    def _refuse_impossible(self, options: Sequence[Option]) -> None:
        """Raises `InvalidInstanceError` if no arm can go on because of what a job asks for."""
        if all(option.arm in self._why for option in options):
            raise InvalidInstanceError(self._why[options[0].arm])

    def _refuse_full_gripper(self) -> None:
        """Raises `InvalidInstanceError` if jobs are left that grasp an object, and their arms hold others for good."""
        for state in self._dispatch.left:
            first = first_object_step(state.job)
            assert first is not None
            held = next((held for held in self._handling.world.held.values()), None)
            raise InvalidInstanceError(
                f"job '{state.job.name}' grasps '{first.object}', but the gripper of its arm is full: it holds"
                f" '{held.name if held else ''}'"
            )

    def _stuck(self, options: Sequence[Option]) -> bool:
        names = self._timeline.names
        self.blocked = tuple(names[arm] for arm in sorted({option.arm for option in options}))
        self.reason = next((self._why[option.arm] for option in options if option.arm in self._why), "")
        return False
