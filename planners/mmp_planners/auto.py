"""The planner for people who just want a good plan: whichever finds one first, then made shorter."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import SearchStarted, Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.apf_ecbs import ApfEcbs
from mmp_planners.counts import TreeCounts
from mmp_planners.options import check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.path_recombination import PathRecombination
from mmp_planners.portfolio.run import Run, Step
from mmp_planners.portfolio.shortcutting import Shortcutting
from mmp_planners.prioritized import Prioritized
from mmp_planners.rrt_connect import NODES, Composite
from mmp_planners.seeds import seed_of, sub_seeds

FIRST_TURN, LONGEST_TURN = 500, 200_000
"""Iterations of the composite search in its first turn, twice as many in each further one, and at most."""
ORDERS = 2
"""Orders of the arms that prioritized planning tries in its first turn, twice as many in each further one."""
TREES_FROM = 2
"""Turns of the others before the first tree of APF-ECBS, which takes as long as many orders of the arms."""
GOOD = 1.01
"""Multiple of the straight lines that is not worth more work."""
COARSE = 2
"""Steps of the time grid that are one while a plan is shortened: half the work a look, and as short in the end."""
WORTH = 3e-3
"""Share of the cost for which as many shortcuts are tried again before anything else."""
ALONE, ALONE_WORTH = 500, 5e-4
"""Attempts to shorten the ways of all arms without regard to each other, and the share for which as many more."""
GAIN, STUCK, PATIENCE = 2e-3, 2, 8
"""Share of the cost that a round must save, after how many in vain the plan itself is left alone, and how many may be.
"""
MOST_ORDERS = 8
"""Of the arms, tried in one round."""


@dataclass(kw_only=True)
class PortfolioCounts(TreeCounts):
    """What the members of a portfolio count together, and which of them found the first plan."""

    found_by: str | None = None
    replanned: int = 0
    """Attempts to plan arms with detours anew that made the plan shorter."""
    recombined: int = 0
    """Rounds in which ways of several plans, put together anew, made the plan shorter."""


@dataclass(frozen=True, kw_only=True)
class Auto:
    """A portfolio: composite RRT-Connect, prioritized planning and APF-ECBS take turns, and the plan is shortened.

    Turns are counted, not timed, so the same seed gives the same plan. They fail on different instances: crowding
    decides which of them is fast. While the plan is more than 1 % longer than the straight lines it is shortened on the
    common clock, arms with detours are planned anew, and their ways are put together with those that arms find alone,
    in groups and in other orders, for `rounds` at most.
    """

    about: ClassVar[About] = About(
        paper="portfolio of `rrt-connect`, `prioritized` and `apf-ecbs`; then shortcuts, replanning (MAPF-LNS) and "
        "ways put together by coordination diagrams (O'Donnell, Lozano-Perez 1989) and independence detection "
        "(Standley 2010)",
        guarantee="not complete: it gives up where an arm finds no way even alone; no bound on the cost",
    )

    rounds: int = option(40, "rounds in which the plan is made shorter, at most", least=0)
    shorten: int = option(300, "attempts to shorten the plan, each round", least=0)
    replan: int = option(10, "attempts to plan arms with detours anew, each round", least=0)
    dt: float = option(0.1, "length of a step of the time grid [s]", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        run = Run.begin("auto", self, problem, seed, time_limit)
        run.counts = counts = PortfolioCounts()
        check_steps(problem, self.dt)
        try:
            watch(SearchStarted(elapsed_s=run.elapsed_s, restart=0, sub_seed=run.seed))
            self._first_plan(run, counts, watch)
            run.exhausted = counts.found_by is None and not run.clock.expired
            first = counts.generated_nodes  # nodes of the tree have the numbers before
            run.emit_plan(watch, node=first, parent=None, dt=self.dt)
            if self._improve(run, counts):
                run.emit_plan(watch, node=first + 1, parent=first, dt=self.dt)
        except StopPlanning:
            pass
        return run.result()

    def _first_plan(self, run: Run, counts: PortfolioCounts, watch: Watcher) -> None:
        """TreeCounts who found a plan; nobody when time is up, or where an arm finds no way even alone."""
        members = {
            "rrt-connect": self._composite(run),
            "prioritized": _doubling(Prioritized(dt=self.dt).search(run, counts, watch).rounds(run.seed), ORDERS),
            "apf-ecbs": itertools.chain([None] * TREES_FROM, self._tree(run, counts, watch)),
        }
        while len(members) > 1:  # the composite search never ends by itself
            for name, turns in list(members.items()):
                if run.clock.expired:
                    return
                try:
                    over = next(turns, "over") == "over"
                finally:  # a watcher may stop the run on being told of the plan
                    counts.found_by = name if run.best is not None else None
                if run.best is not None:
                    return
                if over:
                    del members[name]

    def _composite(self, run: Run) -> Iterator[None]:
        composite, iterations = Composite(), FIRST_TURN
        for sub_seed in sub_seeds(run.seed):
            search = composite.search(run.problem, sub_seed)
            while search.nodes < NODES:
                if run.clock.expired:
                    return
                plan = composite.grow(run.problem, search, iterations, run.clock)
                if plan is not None and run.offer(plan):
                    return
                iterations = min(2 * iterations, LONGEST_TURN)
                yield
            run.counts.restarts += 1

    def _tree(self, run: Run, counts: PortfolioCounts, watch: Watcher) -> Iterator[None]:
        tree = ApfEcbs(dt=self.dt).grow(run, counts, watch)
        try:
            for _ in tree.rounds(run.seed):
                yield
        finally:  # after a stop too
            if tree.best is not None:
                run.take(dataclasses.replace(tree.best, bound_met=None), tree.found_s)

    def _improve(self, run: Run, counts: PortfolioCounts) -> bool:
        """Whether the plan got any shorter."""
        if run.best is None:
            return False
        dt, bound, first, in_vain = COARSE * self.dt, run.problem.cost_lower_bound_rad, run.best.cost, 0
        shorten = Shortcutting(attempts=self.shorten, dt=dt, worth=WORTH)
        replan = LargeNeighbourhoodSearch(attempts=self.replan, dt=dt)
        alone = Shortcutting(attempts=ALONE, dt=dt, worth=ALONE_WORTH)
        recombine: PathRecombination | None = None
        for turn in range(self.rounds):
            before, other = run.best.cost, None
            if before <= GOOD * bound or in_vain == PATIENCE or run.clock.expired:
                break
            if turn > 0:
                recombine = recombine or PathRecombination(run, run.best.plan, self.dt, shorten, alone)
                other = recombine(run.best.plan, min(2 ** max(in_vain - 1, 0), MOST_ORDERS), turn)
            if other is not None or in_vain < STUCK:
                cut = Step(part=shorten, seed=seed_of(run.seed, turn))
                anew = Step(part=replan, seed=seed_of(run.seed, turn, 1), above=GOOD * bound)
                counts.replanned += run.improve(cut, anew, start=other)[1]
                counts.recombined += other is not None and run.best.cost < before
            in_vain = in_vain + 1 if run.best.cost > (1 - GAIN) * before else 0
        return run.best.cost < first


def _doubling(turns: Iterator[None], count: int) -> Iterator[None]:
    """Turns that are `count` of the given ones, then twice as many, and so on."""
    while sum(1 for _ in itertools.islice(turns, count)):
        yield
        count *= 2
