"""Ways of several plans put together anew, one for each arm: plans in which the arms pass each other in another order.

Shortcuts and replanning end where no single arm finds a shorter way among the others. What more there is to gain lies
in who passes whom, and on which side. So ways are collected: those of the best plan so far, those that other orders of
the arms bring, and each of them as short as it becomes if its arm is the only one. Of the choices of one way for each
arm the shortest that all arms can drive at once is taken (`native/recombination.hpp`). Waiting costs nothing, so all
that has to be found is who waits for whom.
"""

from __future__ import annotations

import dataclasses
import itertools

from mmp_env import _core
from mmp_env.collision import HIT, KEEP_PROOF
from mmp_env.events import ignore
from mmp_env.plan import Plan
from mmp_planners.counts import ArmCounts
from mmp_planners.finishing import Run, Step
from mmp_planners.prioritized import Prioritized
from mmp_planners.seeds import seed_of
from mmp_planners.shortcutting import Shortcutting, on_grid, paced

GAIN_RAD = 1e-3
"""Least that other ways must save."""
MOST_STEPS = 500
"""Of the first plan on the grid of the ways: what two arms may do is worked out by the product of their steps."""


class Recombining:
    """The ways of one run, on a grid of `dt` [s]; `shorten` is for plans, `alone` for ways without regard to others."""

    def __init__(self, run: Run, first: Plan, dt: float, shorten: Shortcutting, alone: Shortcutting) -> None:
        self._run, self._dt, self._shorten, self._alone = run, dt, shorten, alone
        self._grid = max(dt, first.makespan_s / MOST_STEPS)
        self._ways = _core.Recombination(
            run.problem.cell.collision.core,
            [run.problem.max_velocity[name] * self._grid for name in run.problem.cell.arm_names],
            HIT * run.problem.margin,
            KEEP_PROOF * run.problem.margin,
        )

    def __call__(self, best: Plan, orders: int, turn: int) -> Plan | None:
        """A plan that is shorter than `best`, its certificate still to come, or None; none is given twice.

        So many more `orders` of the arms are tried before; every `turn` has its own seeds.
        """
        clock = self._run.early_clock()
        seeds = [seed_of(self._run.seed, turn, 2 + k) for k in range(4)]
        other = dataclasses.replace(self._run, clock=clock, counts=ArmCounts(), best=None, found_s=None)
        search = Prioritized(dt=self._dt).search(other, ArmCounts(), ignore)
        for _ in itertools.islice(search.rounds(seeds[0]), orders):
            pass
        self._add(best)
        self._add(self._alone(best, seeds[1], clock)[0])
        if other.best is not None:
            other.improve(Step(part=self._shorten, seed=seeds[2]))
            self._add(other.best.plan)
            self._add(self._alone(other.best.plan, seeds[3], clock)[0])
        elif len(search.alone) == len(search.arms.names):
            self._add(self._alone(search.arms.plan(search.alone), seeds[3], clock)[0])
        rows = self._ways.run(best.cost_rad - GAIN_RAD, clock)
        self._run.cut_short |= clock.expired
        return None if rows is None else paced(best.problem, rows)

    def _add(self, plan: Plan) -> None:
        self._ways.add(on_grid(plan, self._grid))
