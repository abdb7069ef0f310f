"""Common part of the planners of the CBS family: their options, and how a search becomes a result."""

from __future__ import annotations

import abc
import dataclasses
import math
from dataclasses import dataclass, field
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import Watcher, ignore, wants_iterates
from mmp_env.model.problem import Problem
from mmp_planners.conflict_tree.conflict_choice import ORDERS, ConflictChoice
from mmp_planners.conflict_tree.constraints import ConstraintKind
from mmp_planners.conflict_tree.constraints.named import KINDS, constraint_kind
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import EagerExpansion, Expansion, Experience, FromScratch
from mmp_planners.conflict_tree.fast_track import FastTrack, NoFastTrack, RepulsionOfSeveralArms
from mmp_planners.conflict_tree.repulsion import Modification, NoModification, RepulsiveModification, traced, yielding
from mmp_planners.conflict_tree.search import ConflictTree
from mmp_planners.conflict_tree.selection import Selection
from mmp_planners.counts import TreeCounts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import PlanResult, StopPlanning
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.improve import shorten
from mmp_planners.portfolio.run import Run

LOW_LEVEL = SiRrtStar(iterations=200)
"""Single-arm planner with a small limit: a failed call is repeated with a larger budget and another seed."""


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a conflict-tree planner. The defaults are those of plain CBS."""

    selection: Selection
    branching: ConstraintKind
    expansion: Expansion = field(default_factory=EagerExpansion)
    experience: Experience = field(default_factory=FromScratch)
    modification: Modification = field(default_factory=NoModification)
    fast_track: FastTrack = field(default_factory=NoFastTrack)


@dataclass(frozen=True, kw_only=True)
class TreePlanner(abc.ABC):
    """A planner of the family: a name, options, and the parts that it makes of them. The search is the same for all.

    `docs/explanation/paper.md` lists the design decisions behind the defaults.
    """

    name: ClassVar[str]

    dt: float = option(GRID_STEP_S, "length of a step of the time grid [s]", positive=True)
    restarts: bool = option(True, "begin a new tree with another sub-seed when a tree makes no progress; off: one tree")
    bound: str = option(
        "paths",
        "what w relates to: paths: the planner's own path lengths; straight: the straight lines, an absolute bound",
        choices=("paths", "straight"),
    )
    patience: int = option(20, "expansions after a solution in which a cheaper one may still be found", positive=True)
    eta: float = option(LOW_LEVEL.eta, "steering distance of the single-arm planner [rad]", least=0.01, most=100)
    iterations: int = option(
        LOW_LEVEL.iterations, "single-arm iterations without a path before a call fails", positive=True
    )
    shortcuts: int = option(LOW_LEVEL.shortcuts, "attempts to shorten each single-arm path", least=0)
    improve: int = option(LOW_LEVEL.improve, "single-arm iterations after the first path", least=0)
    direct: bool = option(
        LOW_LEVEL.direct,
        "single-arm paths without samples are tried first: straight lines, and the branch of the static tree",
    )
    static_tree: bool = option(
        LOW_LEVEL.static_tree, "single-arm calls share a tree that is grown from the goals once, without constraints"
    )
    shorten: int = option(0, "attempts to shorten the plan on the common clock; 0: keep it as found", least=0)
    conflict_choice: str = option(
        "alternating",
        "conflict that is branched on, earliest (paper-literal): the earliest; alternating: in every second tree that "
        "of a pair whose arms are in the fewest other pairs",
        choices=tuple(ORDERS),
    )
    pad: float = option(
        0.25, "avoid-state: time that the constraint reaches beyond the conflict, in the first tree [s]", positive=True
    )
    pad_growth: float = option(
        1.4, "factor of `pad` from one tree to the next, for eight trees; then it begins again", least=1.0, most=2.0
    )

    def __post_init__(self) -> None:
        check_options(self)

    @abc.abstractmethod
    def parts(self, seed: int) -> Parts:
        """Returns the parts of the search; `seed` is for parts that draw random numbers."""

    def low_level(self) -> SiRrtStar:
        """Returns the single-arm planner with the options."""
        return SiRrtStar(
            eta=self.eta,
            iterations=self.iterations,
            shortcuts=self.shortcuts,
            improve=self.improve,
            direct=self.direct,
            static_tree=self.static_tree,
        )

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Runs the search.

        Args:
            problem: the problem to solve.
            seed: seed of all random numbers. The same seed gives the same plan, unless the time limit is hit.
            time_limit: time limit [s].
            watch: watcher that gets the events of the search.

        Raises:
            MmpError: if an argument is not allowed.
        """
        counts = TreeCounts()
        run = Run.begin(self.name, self, problem, seed, time_limit, counts=counts)
        check_steps(problem, self.dt)
        tree: ConflictTree | None = None
        exhausted = False
        try:  # a signal handler may stop the run at any moment, also before the search begins and after it ends
            tree = self.grow(run, counts, watch)
            exhausted = tree.run(run.seed)
            run.take(tree.best, tree.found_s)
            if shorten(run, self.shorten, self.dt) and tree.best is not None and run.best is not None:
                if run.best.bound_met is not None:
                    run.best = dataclasses.replace(run.best, bound_met=run.best.cost <= tree.good_cost)
                run.emit_plan(watch, node=counts.generated_nodes, parent=tree.best.node, dt=self.dt)
        except StopPlanning:
            if tree is not None and run.best is None:
                run.take(tree.best, tree.found_s)
        return run.result(exhausted=exhausted)

    def grow(self, run: Run, counts: TreeCounts, watch: Watcher) -> ConflictTree:
        """Returns the search of a run, about to begin; it counts in `counts`."""
        context = PlanningContext(run.problem, self.dt, self.low_level(), run.clock)
        parts = self.parts(run.seed)
        if wants_iterates(watch):
            parts = dataclasses.replace(parts, modification=traced(parts.modification))
        return ConflictTree(
            context=context,
            emitter=EventEmitter(watch, context),
            began=run.began,
            restarts=self.restarts,
            choice=ConflictChoice(orders=ORDERS[self.conflict_choice], pad_growth=self.pad_growth),
            patience=self.patience,
            absolute_bound=run.problem.cost_lower_bound_rad if self.bound == "straight" else None,
            counts=counts,
            **{part.name: getattr(parts, part.name) for part in dataclasses.fields(parts)},
        )


@dataclass(frozen=True, kw_only=True)
class OneKindPlanner(TreePlanner):
    """A planner that branches with one constraint kind, chosen by the option `constraint`."""

    constraint: str = option("avoid-state", f"what a branch forbids: {', '.join(KINDS)}", choices=KINDS)
    radius: float = option(0.2, "vertex: radius of the forbidden ball [rad]", positive=True)
    sphere_radius: float = option(0.1, "sphere: radius of the forbidden sphere [m]", positive=True)

    def branching(self) -> ConstraintKind:
        """Returns the constraint kind that the option `constraint` names."""
        return constraint_kind(self.constraint, pad=self.pad, radius=self.radius, sphere_radius=self.sphere_radius)


@dataclass(frozen=True, kw_only=True)
class RepulsionOption:
    """Option of planners without repulsion of their own: the repulsion of APF-ECBS as a part, with its defaults.

    With repulsion, `bound_met` is about path lengths before repulsion, as with `apf-ecbs`.
    """

    repulsion: str = option(
        "off",
        "repulsion of apf-ecbs, with its defaults, paths: of each replanned path; fast-track: and of the arms in "
        "conflict of each node; off: none",
        choices=("off", "paths", "fast-track"),
    )

    def repelled(self, parts: Parts) -> Parts:
        """Returns the parts with the repulsion that the option names."""
        if self.repulsion == "off":
            return parts
        modification = RepulsiveModification()
        tried = RepulsionOfSeveralArms(modification=modification, last_resort=yielding(modification), on_children=True)
        fast_track = tried if self.repulsion == "fast-track" else parts.fast_track
        return dataclasses.replace(parts, modification=modification, fast_track=fast_track)
