"""A portfolio of planners: the first plan of any member, then improved."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import SearchStarted, Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.apf_ecbs import ApfEcbs
from mmp_planners.counts import PortfolioCounts
from mmp_planners.group_rrt import GroupRrt
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.improve import ImprovementRounds
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.settings import PortfolioSettings
from mmp_planners.portfolio.turns import Member, Turn
from mmp_planners.portfolio.wait_removal import waits_option

SETTINGS = PortfolioSettings()


@dataclass(frozen=True, kw_only=True)
class Auto:
    """A portfolio: RRT-Connect for groups of arms, then also APF-ECBS in turns with it; and the plan is improved.

    The members fail on different instances. Their work is counted, not timed, so the same seed gives the same plan. A
    member gets less of the work after attempts that failed.

    While the plan costs more than `until` times the straight lines, up to `rounds` rounds improve it, and the watcher
    gets each better plan. A round shortens the plan on the common clock and replans arms with detours among the others
    (LNS). Later rounds first recombine the known paths of all arms. Before the first round and at the end, waits that
    the order of the arms does not need are removed.
    """

    about: ClassVar[About] = About(
        paper="portfolio of `group-rrt` and `apf-ecbs`; then shortcuts, MAPF-LNS (Li et al. 2021) "
        "and path recombination by coordination diagrams (O'Donnell, Lozano-Perez 1989) with independence detection "
        "(Standley 2010)",
        guarantee="not complete: it gives up if an arm finds no path even alone; no bound on the cost",
    )

    until: float = option(1.003, "cost relative to the straight lines at which the plan is good enough", least=1.0)
    rounds: int = option(40, "largest number of rounds that improve the plan", least=0)
    shorten: int = option(300, "attempts to shorten the plan in each round", least=0)
    replan: int = option(
        10,
        "attempts to replan arms with detours in each round; half as many for a long first plan",
        least=0,
    )
    waits: str = waits_option()
    dt: float = option(GRID_STEP_S, "length of a step of the time grid [s]", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans a problem. Arguments and result are those of `Planner.plan`."""
        counts = PortfolioCounts()
        run = Run.begin("auto", self, problem, seed, time_limit, counts=counts, removes_waits=self.waits == "removed")
        check_steps(problem, self.dt)
        exhausted = False
        improve = ImprovementRounds(
            rounds=self.rounds,
            shorten=self.shorten,
            replan=self.replan,
            until=self.until,
            dt=self.dt,
            settings=SETTINGS,
        )
        try:
            watch(SearchStarted(elapsed_s=run.elapsed_s, restart=0, sub_seed=run.seed))
            self._find_first_plan(run, counts, watch)
            exhausted = counts.found_by is None and not run.clock.expired
            first = counts.generated_nodes  # nodes of the tree have the numbers before
            run.emit_plan(watch, node=first, parent=None, dt=self.dt)
            last = improve(run, counts, watch, first)
            if run.removes_waits and run.remove_waits():
                run.emit_plan(watch, node=last + 1, parent=last, dt=self.dt)
        except StopPlanning:
            pass
        return run.result(exhausted=exhausted)

    def _find_first_plan(self, run: Run, counts: PortfolioCounts, watch: Watcher) -> None:
        """Lets the members take turns until one finds a plan, time is up, or an arm finds no path even alone."""
        members = [
            Member(name="group-rrt", turns=GroupRrt().turns(run)),
            Member(
                name="apf-ecbs",
                turns=self._grow_trees(run, counts, watch),
                share=SETTINGS.tree_share,
                waited=SETTINGS.work_before_tree,
            ),
        ]
        while len(members) > 1 and not run.clock.expired:  # the search for groups never ends without a plan
            member = min(members, key=lambda member: member.waited)
            try:
                turn = next(member.turns, None)
            finally:  # a watcher may stop the run when it gets the plan
                counts.found_by = member.name if run.best is not None else None
            if run.best is not None:
                return
            if turn is None:
                members.remove(member)
            else:
                member.count(turn)

    def _grow_trees(self, run: Run, counts: PortfolioCounts, watch: Watcher) -> Iterator[Turn]:
        tree, done, failed = ApfEcbs(dt=self.dt).grow(run, counts, watch), 0, 0
        try:
            for _ in tree.steps(run.seed):
                if tree.best is not None:
                    return
                yield Turn(tree.context.work - done, failed=tree.failed_trees > failed)
                done, failed = tree.context.work, tree.failed_trees
        finally:  # after a stop too
            if tree.best is not None:
                run.take(dataclasses.replace(tree.best, bound_met=None), tree.found_s)
