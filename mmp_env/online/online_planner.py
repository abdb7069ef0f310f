"""Planning while the arms move: what is committed is always proved, and ends at rest."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, given, known_keywords, number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell, given_cell
from mmp_env.model.goals import GivenGoal
from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY
from mmp_env.model.robot import frozen_array
from mmp_env.online.bodies import MovingBody, grown
from mmp_env.online.budget import Budget, NoCollection
from mmp_env.online.commitment import Commitment
from mmp_env.online.motion import PERIOD_S, OnlineMotion
from mmp_env.online.planning import AT_GOAL, RATE_HZ, PathPlanner, Wanted
from mmp_env.problems.making import make_problem
from mmp_env.retime import RetimeOptions, retime
from mmp_env.retime.limits import JointLimits

LONGEST_S = 3600.0
"""Largest time for one call [s]."""
_BODY_NEAR = "a body may reach an arm before that can leave ({}); the other arms are at their goals"
_SAME = 1e-6
"""Difference of times [periods] within which they are the same."""


@dataclass(frozen=True, kw_only=True)
class OnlineStep:
    """What one call of `replan` committed.

    Attributes:
        kind: `continuation` if the arms move towards the goal or stand there, `stop` if they come to rest before it
            and nothing that leads there is proved.
        begins_s: from when on the committed motion may differ from that before the call [s].
        ends_s: when the arms come to rest, if there is no other call [s].
        arrives: whether they rest at the goal then.
        reason: why it is a stop, otherwise empty.
        seconds: duration of the call [s].
    """

    kind: str
    begins_s: float
    ends_s: float
    arrives: bool
    reason: str
    seconds: float


class OnlinePlanner:
    """Plans while the arms move. What is committed is proved and ends at rest, at every moment.

    The proof holds for obstacles that keep to the largest speed that was given: no moving arm comes closer to them than
    the margin. An obstacle that moves may come to an arm that stands. docs/explanation/online.md has the details.

    Args:
        cell: arms and obstacles.
        start: arm name -> where the arms stand, as in `make_problem`.
        planner: name of the planner of paths.
        seed: seed of its first call; later calls count up.
        max_velocity: [rad/s], as in `make_problem`.
        margin: [m], as in `make_problem`.
        max_acceleration: [rad/s^2], as in `retime`.
        max_jerk: [rad/s^3], as in `retime`.
        clock: returns the time [s], never decreasing; by default real time since now. The times of all answers are on
            this clock. Time limits are in real time.

    Raises:
        MmpError: for wrong arguments, and like `make_problem`.
    """

    @known_keywords
    def __init__(
        self,
        cell: Cell,
        start: Mapping[str, GivenGoal],
        *,
        planner: str = "auto",
        seed: int = 0,
        max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
        margin: float | Mapping[str, float] | Margins | None = None,
        max_acceleration: JointLimits = None,
        max_jerk: JointLimits = None,
        clock: Callable[[], float] | None = None,
    ) -> None:
        if clock is not None and not callable(clock):
            raise refused("clock", clock, "a function that returns the time [s], or None")
        moving = [obstacle for obstacle in given_cell(cell).obstacles if obstacle.speed]
        self._cell = replace(cell, obstacles=tuple(each for each in cell.obstacles if not each.speed))
        problem = make_problem(self._cell, start, start, max_velocity=max_velocity, margin=margin)
        self._problem = problem
        self._options = RetimeOptions(rate=RATE_HZ, max_acceleration=max_acceleration, max_jerk=max_jerk)
        self._paths = PathPlanner(planner, seed, max_velocity, problem.margins, self._options)
        began = time.monotonic()
        self._clock = clock if clock is not None else lambda: time.monotonic() - began
        self._committed = Commitment(problem.start, problem.margins.obstacles)
        self._wanted: Wanted | None = None
        self._waits = False  # whether arms with a body near them shall wait while the others move
        self._arrived: Wanted | None = None  # the goals at which the arms stand when no motion is left
        for obstacle in moving:
            self._see(obstacle, obstacle.speed)

    @property
    def now(self) -> float:
        """The time [s]."""
        return float(self._clock())

    @property
    def ends_s(self) -> float:
        """When the arms come to rest, if nothing else is committed [s]."""
        return max([self.now, *(PERIOD_S * motion.end for motion in self._committed.motions)])

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """All obstacles: those of the cell, and the others where they were seen last."""
        return (*self._cell.obstacles, *(body.solid for body in self._committed.bodies.values()))

    def state(self, time_s: float) -> dict[str, Float[np.ndarray, "_dof"]]:
        """Returns arm name -> the committed configuration [dof] at a time [s], not before the last call."""
        return {name: rows[0] for name, rows in self.positions(np.array([time_s])).items()}

    def positions(self, times: Float[np.ndarray, "n"]) -> dict[str, Float[np.ndarray, "n _dof"]]:
        """Returns arm name -> the committed configurations [n, dof] at ascending times [s]."""
        return self._committed.positions(self._cell, np.asarray(times, dtype=float) / PERIOD_S)

    def committed(self) -> Plan:
        """Returns the committed motion from now on as a plan, straight between times 10 ms apart.

        Obstacles that move have their speed, and cover where they may be now, so `check_plan` proves it again.
        """
        now = self.now
        left = max(self.ends_s - now, PERIOD_S)
        times = np.append(PERIOD_S * np.arange(math.ceil(left / PERIOD_S - _SAME)), left)
        rows = {name: np.ascontiguousarray(q) for name, q in self.positions(now + times).items()}
        moving = (replace(grown(b.solid, b.growth(now)), speed=b.speed) for b in self._committed.bodies.values())
        cell = replace(self._cell, obstacles=(*self._cell.obstacles, *moving))
        first, last = ({name: q[k] for name, q in rows.items()} for k in (0, -1))
        problem = replace(self._problem, cell=cell, start=first, goal=last, goals={})
        return Plan(problem=problem, times=times, positions=rows)

    def follow(self, plan: Plan) -> OnlineStep:
        """Commits a plan that starts where the arms rest.

        Args:
            plan: retimed with a share below 1, or not retimed.

        Returns:
            What is committed.

        Raises:
            MmpError: if the plan starts elsewhere, is for another cell, or cannot be retimed and proved.
        """
        began = time.perf_counter()
        plan = given("plan", plan, Plan, "a Plan")
        first = self._forget_past()
        for name, q in self._committed.rest().items():
            if name not in plan.positions or not np.array_equal(plan.positions[name][0], q):
                raise MmpError(f"the plan does not start where arm '{name}' comes to rest; replan leads there")
        if not plan.retimed:
            options = self._options
            plan = retime(plan, rate=options.rate, max_acceleration=options.max_acceleration, max_jerk=options.max_jerk)
        self._wanted = Wanted(goal=plan.problem.goal)
        self._committed.append(OnlineMotion(plan, self._wanted.goal), first, Budget(LONGEST_S))
        return self._step(first, "the motion cannot be proved among the bodies", began)

    def add_obstacle(self, obstacle: Obstacle, *, speed: float = 0.0) -> bool:
        """Adds an obstacle that has appeared.

        Args:
            obstacle: any solid but a mesh, with a name of its own.
            speed: largest speed of any of its points from now on [m/s].

        Returns:
            Whether the committed motion is proved. If it was not, the arms brake at once; what is committed now is
            proved if the stop is.

        Raises:
            MmpError: for a mesh, a name that is taken or a wrong speed.
        """
        given("obstacle", obstacle, Obstacle, "an Obstacle")
        if obstacle.name in {each.name for each in self.obstacles}:
            raise MmpError(f"there is an obstacle '{obstacle.name}' already; move_obstacle moves it")
        replace(self._cell, obstacles=(*self._cell.obstacles, obstacle))  # checks the name
        return self._see(obstacle, speed)

    def move_obstacle(self, name: str, pose: ArrayLike, *, speed: float) -> bool:
        """Tells where an obstacle is now.

        Args:
            name: its name.
            pose: position [3] [m], or position and quaternion [7] (wxyz) of its frame in the world.
            speed: largest speed of any of its points from now on [m/s].

        Returns:
            Whether the committed motion is proved, as `add_obstacle`.

        Raises:
            UnknownNameError: for an unknown obstacle.
            MmpError: for a mesh, a wrong pose or a wrong speed.
        """
        known = {each.name: each for each in self.obstacles}
        if name not in known:
            raise UnknownNameError("obstacle", name, known)
        numbers = as_numbers(pose)
        if numbers is None or numbers.shape not in {(3,), (7,)} or not np.isfinite(numbers).all():
            raise refused("pose", pose, "3 finite numbers, a position [m], or 7 with a quaternion (wxyz)")
        turn = numbers[3:] if len(numbers) == 7 else known[name].quaternion
        if not np.any(turn):
            raise refused("pose", pose, "with a quaternion (wxyz) that is not all zero")
        moved = replace(
            known[name], position=frozen_array(numbers[:3]), quaternion=frozen_array(turn / np.linalg.norm(turn))
        )
        return self._see(moved, speed)

    def remove_obstacle(self, name: str) -> None:
        """Removes an obstacle. Raises `UnknownNameError`."""
        known = [each.name for each in self.obstacles]
        if name not in known:
            raise UnknownNameError("obstacle", name, known)
        self._without(name)

    @known_keywords
    def replan(self, goal: Mapping[str, GivenGoal], *, within: float) -> OnlineStep:
        """Commits a proved continuation to goals, or the proved stop.

        What was committed before `within` from now stays. Arms that move towards other goals brake, and go on from
        rest. A path that bodies have blocked is left for another one.

        Args:
            goal: arm name -> goal, in the forms of `make_problem`.
            within: when this returns at the latest, from now [s] of real time.

        Returns:
            What is committed.

        Raises:
            MmpError: for goals that `make_problem` refuses in the cell without bodies that move.
        """
        began = time.perf_counter()
        within = number("within", within, "a time above 0 [s]")
        if within > LONGEST_S:
            raise refused("within", within, f"a time of {LONGEST_S:g} s at most")
        with NoCollection():
            budget = Budget(within)
            first = self._forget_past(within)
            if self._wanted is None or not self._wanted.is_same(goal):
                self._paths.check(self._cell, self._committed.rest(), goal)
                self._wanted = Wanted(goal=dict(goal))
            return self._step(first, self._go_on(first, budget), began)

    def _go_on(self, first: int, budget: Budget) -> str:
        """Commits what leads to the goals. Returns why nothing does, or an empty text."""
        wanted, now = self._wanted, self._committed
        assert wanted is not None
        begun = [motion for motion in now.motions if motion.begin < first]
        active = begun[-1] if begun else None
        if active is not None and active.goal is wanted.goal:
            now.extend(active, first, budget, whole=len(now.motions) > len(begun))
            if active.arrives:
                now.motions = begun
                return ""
            is_last = len(now.motions) == len(begun)
            if is_last and active.whole and not active.ends and not now.is_blocked(active, first, self.now, budget):
                return "" if active.end > first else "a body may come into the way"
        else:
            if active is not None and active.end > first:
                now.brake(active, first)
            if now.motions and now.motions[-1].goal is not wanted.goal:
                now.motions = begun
        if len(now.motions) > len(begun):
            last = now.motions[-1]
            now.extend(last, max(first, last.begin), budget)
            return ""
        if self._arrived is wanted and not now.motions:
            return ""
        return self._detour(first, wanted, budget)

    def _detour(self, first: int, wanted: Wanted, budget: Budget) -> str:
        """Plans from where the arms come to rest, and appends what is proved. Returns why nothing is, or nothing."""
        now = self._committed
        waiting = now.trapped(self._cell) if self._waits else frozenset()
        motion, reason = self._paths.motion(self._cell, now.rest(), wanted, now.bodies.values(), budget, waiting)
        if motion is None:
            if waiting:
                self._waits = False
                return _BODY_NEAR.format(", ".join(sorted(waiting))) if reason == AT_GOAL else reason
            if reason == AT_GOAL and now.end(first) == first:
                now.stand()
                self._arrived = wanted
            return reason
        if now.append(motion, first, budget):
            self._waits = False
            return ""
        if motion.whole and motion.proved_s == motion.first_s:
            self._paths.keep(motion)
            return "no time to prove the motion"
        self._waits = not motion.waiting
        return "the motion cannot be proved among the bodies"

    def _see(self, solid: Obstacle, speed: float) -> bool:
        """Adds or replaces a body, and proves again what is committed."""
        if solid.pieces:
            raise MmpError(f"obstacle '{solid.name}' is a mesh; a body that moves must be of another shape")
        speed = number("speed", speed, "a speed [m/s], 0 or more", zero=True)
        self._without(solid.name)
        body = MovingBody(solid=replace(solid, speed=0.0), speed=speed, seen_s=self.now)
        return self._committed.see(body, self._forget_past())

    def _without(self, name: str) -> None:
        if not self._committed.unsee(name) and any(each.name == name for each in self._cell.obstacles):
            others = tuple(each for each in self._cell.obstacles if each.name != name)
            self._cell = replace(self._cell, obstacles=others)

    def _forget_past(self, within: float = 0.0) -> int:
        """Forgets what is over. Returns the first period that begins after `within` [s] from now."""
        now = self.now
        over = self._committed.forget(math.floor(now / PERIOD_S))
        if over is not None:
            is_there = over.arrives and self._wanted is not None and over.goal is self._wanted.goal
            self._arrived = self._wanted if is_there else None
        return math.ceil((now + within) / PERIOD_S - _SAME) + 1

    def _step(self, first: int, reason: str, began: float) -> OnlineStep:
        motions, wanted = self._committed.motions, self._wanted
        heads = bool(motions) and wanted is not None and motions[-1].goal is wanted.goal
        moving = heads and motions[-1].end > first
        there = (heads and motions[-1].arrives) or (not motions and self._arrived is wanted)
        return OnlineStep(
            kind="continuation" if moving or there else "stop",
            begins_s=PERIOD_S * first,
            ends_s=self.ends_s,
            arrives=there,
            reason="" if moving or there else reason,
            seconds=time.perf_counter() - began,
        )
