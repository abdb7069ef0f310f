"""The domain of the searches: arms on a time grid, their single-arm planners, conflicts, contacts and proofs.

The searches know no geometry. They ask a `PlanningContext` for everything about the cell.
"""

from __future__ import annotations

import copy
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.certificate import Certificate, certify
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.arm_bounds import lipschitz
from mmp_planners.goal_choice import ending_at, few, nearest
from mmp_planners.low_level import SiRrtStar

MOST_GOALS = 32
"""Largest number of candidates of an arm that its single-arm planner knows."""
WORK_PER_ITERATION, WORK_PER_PATH = 70, 1800
"""Work of an iteration of the single-arm planner, about its microseconds."""
PairConflicts = Mapping[tuple[int, int], Float[np.ndarray, "c"]]
"""(arm, arm) -> ascending instants of conflict [steps], at most one per step; only pairs in conflict."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Contact:
    """The deepest pair of spheres on the moving links of two arms at an instant [steps].

    Attributes:
        instant: the instant [steps].
        gap: distance of the two surfaces [m], negative in contact.
        point: point halfway between the surfaces [m], in the world.
        links: links of the two spheres; the base is link 0.
    """

    instant: float
    gap: float
    point: Float[np.ndarray, "3"]
    links: tuple[int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """One arm's trajectory on the grid: `q` [k, dof] [rad], of L1 length `length` [rad]. It stays at its last row."""

    q: Float[np.ndarray, "k dof"]
    motion: core.Motion
    length: float

    @property
    def last(self) -> int:
        return len(self.q) - 1

    def at(self, step: float) -> Float[np.ndarray, "dof"]:
        """Returns the configuration [rad] at an instant [steps]."""
        k = min(int(step), self.last)
        return self.q[k] + (step - k) * (self.q[k + 1] - self.q[k]) if k < self.last else self.q[self.last].copy()


class PlanningContext:
    """A problem on a time grid: arms are numbers, times are steps.

    Args:
        problem: the problem to solve.
        dt: step of the grid [s].
        low_level: single-arm planner.
        clock: deadline of the searches.

    Attributes:
        work: work of the single-arm planners so far, about its microseconds.
    """

    def __init__(self, problem: Problem, dt: float, low_level: SiRrtStar, clock: core.Clock) -> None:
        self.problem, self.dt, self.clock = problem, dt, clock
        self.names = problem.cell.arm_names
        self.model = problem.cell.collision
        self.core = self.model.core
        self.conflict_distance = problem.conflict_distances.arms
        self.max_step = [problem.max_velocity[name] * dt for name in self.names]
        self._low_level = low_level
        self._single: list[core.SingleArm] = []
        self._last_contacts: tuple[Hashable, tuple[Contact, ...]] = None, ()
        self.work = 0.0

    def with_clock(self, clock: core.Clock) -> PlanningContext:
        """Returns a context with the same single-arm planners and another deadline."""
        out = copy.copy(self)
        out.clock = clock
        return out

    def reseed(self, seed: int) -> None:
        """Makes new single-arm planners. Their shared state depends on this seed alone."""
        self._single = [
            core.SingleArm(
                self.core,
                k,
                start=np.ascontiguousarray(self.problem.start[name]),
                goals=few(self.problem.goals[name], MOST_GOALS),
                max_step=self.max_step[k],
                levels=self.problem.levels(SEARCH_MARGIN_FACTOR, PLAN_MARGIN_FACTOR),
                seed=seed + k,
                eta=self._low_level.eta,
            )
            for k, name in enumerate(self.names)
        ]

    def low_level(
        self,
        arm: int,
        constraints: Sequence[core.Constraint],
        seed: int,
        budget: float = 1.0,
        others: Sequence[Path] = (),
        experience: Float[np.ndarray, "k dof"] | None = None,
    ) -> tuple[Path | None, int]:
        """Plans one arm.

        Args:
            arm: number of the arm.
            constraints: constraints that the path satisfies.
            seed: seed of the samples.
            budget: factor of the iteration limit.
            others: paths of other arms that the path is proved clear of.
            experience: an earlier path [k, dof] [rad]; the search begins with what is still valid.

        Returns:
            The path or None, and the number of iterations.
        """
        motions = [path.motion for path in others]
        q, iterations = self._low_level(
            self._single[arm], constraints, seed, budget, self.clock, others=motions, experience=experience
        )
        self.work += WORK_PER_ITERATION * iterations + (0 if q is None else WORK_PER_PATH)
        return (None if q is None else self.path(arm, q)), iterations

    def path(self, arm: int, q: Float[np.ndarray, "k dof"]) -> Path:
        """Returns a path through `q` [k, dof] [rad], its ends exactly at the start and at the nearest candidate."""
        start, goal = self.problem.start[self.names[arm]], nearest(self.problem.goals[self.names[arm]], q[-1])
        q = np.clip(q, *self._limits(arm))
        if len(q) == 1 and (start != goal).any():  # so near that the core takes no step for it
            q = np.repeat(q, 2, axis=0)
        q[0], q[-1] = start, goal
        return Path(q=q, motion=self.model.motion(self.names[arm], q), length=float(np.abs(np.diff(q, axis=0)).sum()))

    def until(self, path: Path, arm: int, last: int) -> Path:
        """Returns the path with the steps that the arm stands at its end, up to step `last`."""
        if last <= path.last:
            return path
        q = np.vstack([path.q, np.repeat(path.q[-1:], last - path.last, axis=0)])
        return Path(q=q, motion=self.model.motion(self.names[arm], q), length=path.length)

    def conflicts(self, paths: Sequence[Path], pairs: Sequence[tuple[int, int]]) -> PairConflicts:
        """Returns the conflicts of pairs of arms. Pairs without conflict are proved clear at every instant."""
        found = self.model.conflict_instants(
            [p.motion for p in paths], pairs, self.problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
        )
        return {pair: instants for pair, instants in zip(pairs, found, strict=True) if len(instants)}

    def may_be_near(self, path: Path, other: Path, distance: float) -> bool:
        """Returns whether boxes around the whole paths of two arms are closer than a distance [m]."""
        return path.motion.may_be_near(other.motion, distance)

    def start_touches(self, arm: int, other: int, q: Float[np.ndarray, "dof"]) -> bool:
        """Returns whether `arm` at its start is in conflict with `other` at `q` [rad]."""
        a, b = self.names[arm], self.names[other]
        return bool(self.model.pair_clearance(a, self.problem.start[a][None], b, q[None])[0] < self.conflict_distance)

    def pairs(self, arm: int | None = None) -> list[tuple[int, int]]:
        """Returns all pairs of arms, or those of one arm."""
        n = len(self.names)
        return [(i, j) for i in range(n) for j in range(i + 1, n) if arm is None or arm in (i, j)]

    def plan(self, paths: Sequence[Path]) -> Plan:
        """Returns the paths as a plan that chooses their ends as its goal.

        A step too fast for any joint is stretched for all arms (ScaleTime).
        """
        last = max(path.last for path in paths)
        q = [np.vstack([p.q, np.repeat(p.q[-1:], last - p.last, axis=0)]) for p in paths]
        stretch = np.ones(last)
        for k, rows in enumerate(q):
            if last:
                stretch = np.maximum(stretch, (np.abs(np.diff(rows, axis=0)) / self.max_step[k]).max(axis=1))
        positions = dict(zip(self.names, q, strict=True))
        return Plan(
            problem=ending_at(self.problem, positions),
            times=np.concatenate([[0.0], np.cumsum(stretch * self.dt)]),
            positions=positions,
        )

    def certify(self, plan: Plan) -> Certificate:
        """Certifies a plan in the remaining time. The `instant` of the certificate is in steps."""
        return certify(plan, self.clock)

    def keep_levels(self) -> core.Levels:
        """Returns the static clearances for tests and proofs of a modified path. Every planned path has them."""
        return self.problem.levels(PLAN_MARGIN_FACTOR - 0.1, KEEP_MARGIN_FACTOR)

    def contacts(self, a: int, path_a: Path, b: int, path_b: Path, instants: tuple[float, ...]) -> tuple[Contact, ...]:
        """Returns the contact of two arms at each instant [steps]. Bases do not count, because no path reaches them.

        The last answer is kept: both arms, and several constraint kinds, ask the same in a row.
        """
        question = (a, path_a, b, path_b, instants)
        if self._last_contacts[0] != question:
            self._last_contacts = question, tuple(self._contacts(a, path_a, b, path_b, instants))
        return self._last_contacts[1]

    def lipschitz(self, arm: int) -> float:
        """Returns how far any sphere centre of an arm moves at most if no joint moves more than one rad [m/rad]."""
        return lipschitz(self.problem.cell.arms[arm], self.problem.cell.spheres)

    def _contacts(self, a: int, path_a: Path, b: int, path_b: Path, instants: tuple[float, ...]) -> Iterator[Contact]:
        centers_a, radii_a, links_a = self._moving_spheres(a, path_a, instants)
        centers_b, radii_b, links_b = self._moving_spheres(b, path_b, instants)
        for n, instant in enumerate(instants):
            # Axis by axis, because NumPy is several times as slow with a last axis of three.
            x, y, z = (centers_b[n, None, :, axis] - centers_a[n, :, None, axis] for axis in range(3))
            distance = np.sqrt(x * x + y * y + z * z)
            gaps = distance - radii_a[:, None] - radii_b
            s, t = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
            gap = float(gaps[s, t])
            towards = np.array([x[s, t], y[s, t], z[s, t]]) / max(float(distance[s, t]), 1e-9)
            point = centers_a[n, s] + (radii_a[s] + gap / 2) * towards
            yield Contact(instant=instant, gap=gap, point=point, links=(int(links_a[s]), int(links_b[t])))

    def _moving_spheres(
        self, arm: int, path: Path, instants: tuple[float, ...]
    ) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "s"], np.ndarray]:
        """Returns centres [m], radii [m] and links of the spheres that are not the base's."""
        centers, radii = self.model.spheres(self.names[arm], np.array([path.at(k) for k in instants]))
        links = core.sphere_table(self.core, arm)[:, 0].astype(int)
        moving = links > 0
        return centers[:, moving], radii[moving], links[moving]

    def _limits(self, arm: int) -> tuple[np.ndarray, np.ndarray]:
        robot = self.problem.cell.arms[arm].robot
        return robot.lower, robot.upper
