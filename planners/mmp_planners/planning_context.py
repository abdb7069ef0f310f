"""The domain of the conflict tree: arms on a grid of time steps, their single-arm planners, conflicts and proofs.

The search itself knows no geometry; everything it asks of the cell goes through here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.certificate import Certificate, certify
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.low_level import SiRrtStar

PairConflicts = Mapping[tuple[int, int], Float[np.ndarray, "c"]]
"""(arm, arm) -> instants of conflict in steps, ascending, one a step at most; pairs without conflict are left out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """One arm's trajectory on the grid: `q` [k, dof] [rad]; it stays at its last row. `length`: L1 [rad]."""

    q: Float[np.ndarray, "k dof"]
    motion: core.Motion
    length: float

    @property
    def last(self) -> int:
        return len(self.q) - 1

    def at(self, step: float) -> Float[np.ndarray, "dof"]:
        """Configuration at an instant [steps]."""
        k = min(int(step), self.last)
        return self.q[k] + (step - k) * (self.q[k + 1] - self.q[k]) if k < self.last else self.q[self.last].copy()


class PlanningContext:
    """One run's view of a problem: integers for arms, whole steps of `dt` [s] for times."""

    def __init__(self, problem: Problem, dt: float, low_level: SiRrtStar, clock: core.Clock) -> None:
        self.problem, self.dt, self.clock = problem, dt, clock
        self.names = problem.cell.arm_names
        self.model = problem.cell.collision
        self.core = self.model.core
        self.conflict_distance = problem.conflict_distances.arms
        self.max_step = [problem.max_velocity[name] * dt for name in self.names]
        self._low_level = low_level
        self._single: list[core.SingleArm] = []

    def reseed(self, seed: int) -> None:
        """New single-arm planners: what they share between calls depends on this seed alone."""
        self._single = [
            core.SingleArm(
                self.core,
                k,
                start=np.ascontiguousarray(self.problem.start[name]),
                goal=np.ascontiguousarray(self.problem.goal[name]),
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
        """A path that keeps the constraints, or None, and the iterations it took; `budget` scales the iteration cap.

        It is proved clear of `others`, which are other arms' paths on the same grid. `experience` is a path of this
        arm that the search begins with, as far as it still holds.
        """
        motions = [path.motion for path in others]
        q, iterations = self._low_level(
            self._single[arm], constraints, seed, budget, self.clock, others=motions, experience=experience
        )
        return (None if q is None else self.path(arm, q)), iterations

    def path(self, arm: int, q: Float[np.ndarray, "k dof"]) -> Path:
        """A path through `q`, its ends put exactly on start and goal."""
        start, goal = self.problem.start[self.names[arm]], self.problem.goal[self.names[arm]]
        q = np.clip(q, *self._limits(arm))
        if len(q) == 1 and (start != goal).any():  # so near that the core takes no step for it
            q = np.repeat(q, 2, axis=0)
        q[0], q[-1] = start, goal
        return Path(q=q, motion=self.model.motion(self.names[arm], q), length=float(np.abs(np.diff(q, axis=0)).sum()))

    def conflicts(self, paths: Sequence[Path], pairs: Sequence[tuple[int, int]]) -> PairConflicts:
        """Instants of conflict for each of `pairs`; what is not in conflict is proved clear at every instant."""
        found = self.model.conflict_instants(
            [p.motion for p in paths], pairs, self.problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
        )
        return {pair: instants for pair, instants in zip(pairs, found, strict=True) if len(instants)}

    def start_touches(self, arm: int, other: int, q: Float[np.ndarray, "dof"]) -> bool:
        """Whether `arm` at its start is in conflict with `other` at `q`."""
        a, b = self.names[arm], self.names[other]
        return bool(self.model.pair_clearance(a, self.problem.start[a][None], b, q[None])[0] < self.conflict_distance)

    def pairs(self, arm: int | None = None) -> list[tuple[int, int]]:
        """All pairs of arms, or those of one."""
        n = len(self.names)
        return [(i, j) for i in range(n) for j in range(i + 1, n) if arm is None or arm in (i, j)]

    def plan(self, paths: Sequence[Path]) -> Plan:
        """The paths on one clock. ScaleTime: a step too fast for any joint is stretched for all arms together."""
        last = max(path.last for path in paths)
        q = [np.vstack([p.q, np.repeat(p.q[-1:], last - p.last, axis=0)]) for p in paths]
        stretch = np.ones(last)
        for k, rows in enumerate(q):
            if last:
                stretch = np.maximum(stretch, (np.abs(np.diff(rows, axis=0)) / self.max_step[k]).max(axis=1))
        return Plan(
            problem=self.problem,
            times=np.concatenate([[0.0], np.cumsum(stretch * self.dt)]),
            positions=dict(zip(self.names, q, strict=True)),
        )

    def certify(self, plan: Plan) -> Certificate:
        """The proof of a plan, in the time that is left; its `instant` is in steps."""
        return certify(plan, self.clock)

    def keep_levels(self) -> core.Levels:
        """Static clearances that a modified path is tested at and proved to keep; every planned path passes."""
        return self.problem.levels(PLAN_MARGIN_FACTOR - 0.1, KEEP_MARGIN_FACTOR)

    def _limits(self, arm: int) -> tuple[np.ndarray, np.ndarray]:
        robot = self.problem.cell.arms[arm].robot
        return robot.lower, robot.upper
