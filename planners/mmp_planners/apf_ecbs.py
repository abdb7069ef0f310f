"""APF-ECBS: Hong, Lee, Lee, Nam: Repulsive trajectory modification and conflict resolution for efficient
multi-manipulator motion planning, arXiv 2509.13882, 2025. `conflict_tree/search.py` has the steps of Algorithm 1.

Guarantee: w times the planner's own path lengths before repulsion if `bound_met`. Not complete with the default
constraint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from mmp_env.errors import MmpError
from mmp_planners.conflict_tree.fast_track import RepulsionOfSeveralArms, RepulsiveFastTrack
from mmp_planners.conflict_tree.repulsion import Modification, RepulsiveModification, ShortenedModification, yielding
from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.planner import About
from mmp_planners.tree_planner import OneKindPlanner, Parts, option

ABOUT = About(
    paper="Hong, Lee, Lee, Nam: Repulsive trajectory modification and conflict resolution for efficient "
    "multi-manipulator motion planning, 2025",
    url="https://arxiv.org/abs/2509.13882",
    guarantee="w times the planner's own path lengths before repulsion where `bound_met`; not complete with the "
    "default constraint; the defaults are ours, and `preset=paper` has those of the paper that we know",
)


PAPER: dict[str, Any] = {
    "constraint": "vertex",
    "restarts": False,
    "conflict_choice": "earliest",
    "pad_growth": 1.0,
    "patience": 1_000_000,
    "direct": False,
    "static_tree": False,
    "improve": 200,
    "shortcuts": 0,
    "distance": "centre",
    "step": "gradient",
    "floor": 0.0,
    "cap": 0.0,
    "stretch": 0.0,
    "early_stop": False,
}
"""Options of the preset `paper`: every departure from the paper that has an option is taken back."""
PAPER_FAST_TRACK: dict[str, Any] = {
    "fast_track": "literal",
    "fast_track_at": "expansion",
    "critical_arms": "one",
    "misses": "discarded",
    "last_resort": False,
}
"""Options of the preset `paper` for the fast track."""


@dataclass(frozen=True, kw_only=True)
class RepulsivePlanner(OneKindPlanner):
    """Options of repulsion, common to the planners that have it."""

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"paper": PAPER}

    w: float = option(1.5, "suboptimality factor of the focal list", least=1.0)
    alpha: float = option(RepulsiveModification.alpha, "step size of the gradient descent", positive=True)
    k_rep: float = option(RepulsiveModification.k_rep, "gain of the repulsive potential", positive=True)
    d0: float = option(RepulsiveModification.d0, "largest distance of the repulsive potential [m]", positive=True)
    max_iterations: int = option(RepulsiveModification.max_iterations, "iterations of ModifyMotion", positive=True)
    distance: str = option(
        RepulsiveModification.distance,
        "distance between spheres, surface: of their surfaces; centre (paper-literal): of their centres",
        choices=("surface", "centre"),
    )
    step: str = option(
        RepulsiveModification.step,
        "normalised: steps of `step_rad`, whatever alpha and k_rep are; gradient (paper-literal): alpha "
        "times the force",
        choices=("gradient", "normalised"),
    )
    step_rad: float = option(
        RepulsiveModification.step_rad,
        "normalised: move of the joint that moves most, per iteration [rad]",
        positive=True,
    )
    floor: float = option(
        RepulsiveModification.floor, "distance below which the force is constant [m]; 0 (paper-literal): none", least=0
    )
    cap: float = option(
        RepulsiveModification.cap, "largest move of a joint per iteration [rad]; 0 (paper-literal): any", least=0
    )
    stretch: float = option(
        RepulsiveModification.stretch,
        "the descent ends where a step would take longer than this many steps; 0 (paper-literal): nowhere",
        least=0,
    )
    exact_within: float = option(
        RepulsiveModification.exact_within,
        "distance of convex pieces [m] below which the force has the direction between their nearest points; no effect "
        "without `spheres: exact`; 0 (paper-literal): spheres give it",
        least=0,
    )
    halvings: int = option(
        RepulsiveModification.halvings,
        "line search: how often a step that would end the descent is halved first; 0 (paper-literal): never",
        least=0,
    )
    early_stop: bool = option(
        RepulsiveModification.early_stop, "stop at 2 cm of clearance; off (paper-literal): run all iterations"
    )
    parked_yield: bool = option(
        RepulsiveModification.parked_yield,
        "ours: repel an arm that has arrived too, as long as another arm moves; it returns. No last resort then",
    )
    shorten_paths: bool = option(
        False, "shorten each repelled path, clear of the arms that it is clear of; off (paper-literal): keep detours"
    )
    trace: bool = option(RepulsiveModification.trace, "give watchers every iterate of ModifyMotion; changes no plan")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.floor >= self.d0:
            raise MmpError(
                f"option 'floor' is {self.floor!r} and d0 {self.d0!r}; the floor must be less, or no force acts"
            )
        if 0 < self.stretch < 1:
            raise MmpError(f"option 'stretch' is {self.stretch!r}; it must be 0 for none, or 1 at least")

    def modification(self) -> Modification:
        """Returns ModifyMotion with these options."""
        repulsion = RepulsiveModification(
            alpha=self.alpha,
            k_rep=self.k_rep,
            d0=self.d0,
            max_iterations=self.max_iterations,
            distance=self.distance,
            step=self.step,
            step_rad=self.step_rad,
            floor=self.floor,
            cap=self.cap,
            stretch=self.stretch,
            exact_within=self.exact_within,
            halvings=self.halvings,
            early_stop=self.early_stop,
            parked_yield=self.parked_yield,
            trace=self.trace,
        )
        return ShortenedModification(modification=repulsion) if self.shorten_paths else repulsion


@dataclass(frozen=True, kw_only=True)
class ApfEcbsNf(RepulsivePlanner):
    """APF-ECBS without the fast track: ECBS that repels every replanned path from the other arms."""

    name: ClassVar[str] = "apf-ecbs-nf"
    about: ClassVar[About] = ABOUT

    def parts(self, seed: int) -> Parts:
        return Parts(selection=Focal(w=self.w), branching=self.branching(), modification=self.modification())


@dataclass(frozen=True, kw_only=True)
class ApfEcbs(RepulsivePlanner):
    """APF-ECBS: repulsion after every replanning, and a fast track that repels the arms in conflict of a node."""

    name: ClassVar[str] = "apf-ecbs"
    about: ClassVar[About] = ABOUT
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"paper": {**PAPER, **PAPER_FAST_TRACK}}

    fast_track: str = option(
        "sound",
        "sound: the node stays branchable; literal (paper-literal): it takes the modified path",
        choices=("sound", "literal"),
    )
    fast_track_at: str = option(
        "generation",
        "when the fast track is tried, generation: on each child as soon as it is planned, and on the root; "
        "expansion (paper-literal): on a node that would be branched next",
        choices=("generation", "expansion"),
    )
    critical_arms: str = option(
        "all",
        "arms that the fast track moves, all: every arm in conflict; cover: a smallest set with an arm of each "
        "conflict; one (paper-literal): one arm that is in every conflict",
        choices=("one", "cover", "all"),
    )
    misses: str = option(
        "kept",
        "all and cover: if the fast track leaves fewer conflicts, but not none, kept: the node takes the new paths; "
        "discarded (paper-literal): it keeps its own",
        choices=("kept", "discarded"),
    )
    last_resort: bool = option(
        True,
        "all and cover: if each pair that the fast track leaves in conflict has one after one of its arms has arrived, "
        "arms are repelled after their arrival too, and return; kept if no conflict is left; off (paper-literal): no",
    )

    def parts(self, seed: int) -> Parts:
        repulsion, literal = self.modification(), self.fast_track == "literal"
        on_children = self.fast_track_at == "generation"
        if self.critical_arms == "one":
            fast_track = RepulsiveFastTrack(modification=repulsion, literal=literal, on_children=on_children)
        else:
            fast_track = RepulsionOfSeveralArms(
                modification=repulsion,
                last_resort=yielding(repulsion) if self.last_resort and not self.parked_yield else None,
                reach=self.d0,
                literal=literal,
                on_children=on_children,
                cover=self.critical_arms == "cover",
                keep_misses=self.misses == "kept",
            )
        return Parts(
            selection=Focal(w=self.w),
            branching=self.branching(),
            modification=repulsion,
            fast_track=fast_track,
        )
