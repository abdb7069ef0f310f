"""What the planners of the CBS family have in common: their options, and how a search becomes a result."""

from __future__ import annotations

import abc
import dataclasses
import math
from dataclasses import dataclass, field
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import Watcher, ignore, wants_iterates
from mmp_env.model.problem import Problem
from mmp_planners.conflict_tree.constraints import ConstraintKind
from mmp_planners.conflict_tree.constraints.named import KINDS, constraint_kind
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import EagerExpansion, Expansion, Experience, FromScratch
from mmp_planners.conflict_tree.fast_track import FastTrack, NoFastTrack
from mmp_planners.conflict_tree.repulsion import Modification, Unmodified, traced
from mmp_planners.conflict_tree.search import ConflictTree
from mmp_planners.conflict_tree.selection import Selection
from mmp_planners.counts import Counts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import check_options, check_steps, option
from mmp_planners.planner import PlanResult, StopPlanning
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.run import Run


@dataclass(frozen=True, kw_only=True)
class Parts:
    """What a conflict-tree planner is composed of; what is left out is that of plain CBS."""

    selection: Selection
    branching: ConstraintKind
    expansion: Expansion = field(default_factory=EagerExpansion)
    experience: Experience = field(default_factory=FromScratch)
    modification: Modification = field(default_factory=Unmodified)
    fast_track: FastTrack = field(default_factory=NoFastTrack)


@dataclass(frozen=True, kw_only=True)
class TreePlanner(abc.ABC):
    """A planner of the family is a name, options and the parts that they make; the search is the same for all.

    The defaults of the options are the rulings of docs/explanation/paper.md.
    """

    name: ClassVar[str]

    dt: float = option(0.1, "length of a step of the time grid [s]", positive=True)
    restarts: bool = option(True, "start anew with another sub-seed when a tree does not get on; off: one tree")
    patience: int = option(20, "expansions that a cheaper solution is waited for", positive=True)
    eta: float = option(0.8, "steering distance of the single-arm planner [rad]", least=0.01)
    iterations: int = option(200, "single-arm iterations without a path before a try is given up", positive=True)
    shortcuts: int = option(40, "attempts to shorten each single-arm path", positive=True)
    shorten: int = option(0, "attempts to shorten the plan on the common clock; 0: as it was found", least=0)
    pad: float = option(0.25, "avoid-state: seconds that the window reaches beyond the conflict", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @abc.abstractmethod
    def parts(self, seed: int) -> Parts:
        """What the search is composed of; `seed` is for parts that draw."""

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Runs the search. Raises `MmpError` like `check_run`."""
        run = Run.begin(self.name, self, problem, seed, time_limit)
        run.counts = counts = Counts()
        check_steps(problem, self.dt)
        tree: ConflictTree | None = None
        try:  # a signal handler may stop the run at any moment, before the search begins and after it has ended too
            tree = self.grow(run, counts, watch)
            run.exhausted = tree.run(run.seed)
            run.take(tree.best, tree.found_at)
            if run.shorten(self.shorten, self.dt) and tree.best is not None:
                run.tell(watch, node=counts.generated_nodes, parent=tree.best.node, dt=self.dt)
        except StopPlanning:
            if tree is not None and run.best is None:
                run.take(tree.best, tree.found_at)
        return run.result()

    def grow(self, run: Run, counts: Counts, watch: Watcher) -> ConflictTree:
        """The search of a run, about to begin; it counts in `counts`."""
        low_level = SiRrtStar(eta=self.eta, iterations=self.iterations, shortcuts=self.shortcuts)
        arms = PlanningContext(run.problem, self.dt, low_level, run.clock)
        parts = self.parts(run.seed)
        if wants_iterates(watch):
            parts = dataclasses.replace(parts, modification=traced(parts.modification))
        return ConflictTree(
            arms=arms,
            tell=EventEmitter(watch, arms),
            restarts=self.restarts,
            patience=self.patience,
            counts=counts,
            **{part.name: getattr(parts, part.name) for part in dataclasses.fields(parts)},
        )


@dataclass(frozen=True, kw_only=True)
class OneKindPlanner(TreePlanner):
    """A planner that branches with one constraint kind, whichever is named."""

    constraint: str = option("avoid-state", f"what a branch forbids: {', '.join(KINDS)}", choices=KINDS)
    radius: float = option(0.2, "vertex: radius of the forbidden ball [rad]", positive=True)
    sphere_radius: float = option(0.1, "sphere: radius of the forbidden sphere [m]", positive=True)

    def branching(self) -> ConstraintKind:
        """The kind that `constraint` names."""
        return constraint_kind(self.constraint, pad=self.pad, radius=self.radius, sphere_radius=self.sphere_radius)
