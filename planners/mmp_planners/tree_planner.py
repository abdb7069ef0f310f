"""What the planners of the CBS family have in common: their options, and how a search becomes a result."""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from mmp_env import _core
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.problem import Problem
from mmp_planners.arms import Arms
from mmp_planners.conflict_tree import ConflictTree, bound_or_infinity
from mmp_planners.constraints import AvoidState, ConstraintKind, Vertex
from mmp_planners.events import Watcher
from mmp_planners.fast_track import FastTrack
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planner import PlanResult, Status
from mmp_planners.repulsion import Modification, RepulsiveModification
from mmp_planners.selection import Selection
from mmp_planners.telling import Teller

MOST_STEPS = 100_000
"""Steps that the straight way of one arm may take; a finer grid or slower joints are a mistake in the units."""


def option(
    default: Any, doc: str, *, positive: bool = False, least: float | None = None, choices: tuple[str, ...] = ()
) -> Any:
    """A planner's option: a dataclass field with its documentation and what it allows."""
    metadata = {"doc": doc, "positive": positive or least is not None, "least": least, "choices": choices}
    return dataclasses.field(default=default, metadata=metadata)


def check_options(planner: Any) -> None:
    """Raises `MmpError` for a value that its field does not allow."""
    for f in dataclasses.fields(planner):
        value = getattr(planner, f.name)
        if f.metadata.get("choices") and value not in f.metadata["choices"]:
            raise UnknownNameError(f"value of option '{f.name}'", value, f.metadata["choices"])
        if f.metadata.get("positive") and not (math.isfinite(value) and value > 0):
            raise MmpError(f"option '{f.name}' is {value!r}; it must be a positive number")
        least = f.metadata.get("least")
        if least is not None and value < least:
            raise MmpError(f"option '{f.name}' is {value!r}; it must be {least} at least")


def check_steps(problem: Problem, dt: float) -> None:
    """Raises `MmpError` where the straight way of an arm would take more steps than anything can hold."""
    for name, v_max in problem.max_velocity.items():
        steps = float((np.abs(problem.goal[name] - problem.start[name]) / (v_max * dt)).max())
        if steps > MOST_STEPS:
            raise MmpError(
                f"arm '{name}' needs {steps:.3g} steps of dt {dt} s to its goal; allowed: {MOST_STEPS}. "
                "dt is too short or max_velocity too low"
            )


@dataclass(frozen=True, kw_only=True)
class TreeOptions:
    """Options of every conflict-tree planner; the defaults are the rulings of docs/paper.md."""

    dt: float = option(0.1, "length of a step of the time grid [s]", positive=True)
    constraint: str = option("avoid-state", "what a branch forbids", choices=("avoid-state", "vertex"))
    pad: float = option(0.25, "avoid-state: seconds that the window reaches beyond the conflict", positive=True)
    radius: float = option(0.2, "vertex: radius of the forbidden ball [rad]", positive=True)
    restarts: bool = option(True, "start anew with another sub-seed when a tree does not get on; off: one tree")
    patience: int = option(20, "expansions that a cheaper solution is waited for", positive=True)
    eta: float = option(0.8, "steering distance of the single-arm planner [rad]", least=0.01)
    iterations: int = option(200, "single-arm iterations without a path before a try is given up", positive=True)
    shortcuts: int = option(40, "attempts to shorten each single-arm path", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    def branching(self) -> ConstraintKind:
        return AvoidState(pad=self.pad) if self.constraint == "avoid-state" else Vertex(radius=self.radius)


@dataclass(frozen=True, kw_only=True)
class RepulsionOptions(TreeOptions):
    """Options of the planners that repel."""

    alpha: float = option(1e-7, "step size of the gradient descent", positive=True)
    k_rep: float = option(0.05, "gain of the repulsive potential", positive=True)
    d0: float = option(0.10, "distance beyond which nothing repels [m]", positive=True)
    max_iterations: int = option(50, "iterations of ModifyMotion", positive=True)
    distance: str = option(
        "surface", "distance between sphere surfaces, or centres (the letter)", choices=("surface", "centre")
    )
    step: str = option("normalised", "normalised steps, or gradient (the paper)", choices=("gradient", "normalised"))
    early_stop: bool = option(True, "stop repelling at 2 cm of clearance; off (the letter): run all iterations")
    trace: bool = option(False, "tell watchers every iterate of ModifyMotion; changes no plan")

    def modification(self) -> RepulsiveModification:
        return RepulsiveModification(
            alpha=self.alpha,
            k_rep=self.k_rep,
            d0=self.d0,
            max_iterations=self.max_iterations,
            distance=self.distance,
            step=self.step,
            early_stop=self.early_stop,
            trace=self.trace,
        )


def plan_with_tree(
    name: str,
    options: TreeOptions,
    problem: Problem,
    *,
    selection: Selection,
    modification: Modification,
    fast_track: FastTrack,
    seed: int,
    time_limit: float,
    watch: Watcher,
) -> PlanResult:
    """Runs one composition of the conflict tree. Raises `MmpError` for a negative seed or a time limit of NaN."""
    began = time.perf_counter()
    if seed < 0:
        raise MmpError(f"seed is {seed}; it must be 0 or more")
    check_steps(problem, options.dt)
    clock = _core.Clock(bound_or_infinity(time_limit))
    low_level = SiRrtStar(eta=options.eta, iterations=options.iterations, shortcuts=options.shortcuts)
    arms = Arms(problem, options.dt, low_level, clock)
    tree = ConflictTree(
        arms=arms,
        selection=selection,
        branching=options.branching(),
        modification=modification,
        fast_track=fast_track,
        tell=Teller(watch, arms),
        restarts=options.restarts,
        patience=options.patience,
    )
    exhausted = tree.run(seed)
    return _result(
        tree, exhausted, {"name": name, "options": dataclasses.asdict(options), "seed": seed}, problem, began
    )


def _result(tree: ConflictTree, exhausted: bool, planner: dict[str, Any], problem: Problem, began: float) -> PlanResult:
    best = tree.best
    straight = problem.cost_lower_bound_rad
    counts = dataclasses.asdict(tree.counts)
    stats: dict[str, Any] = {
        **counts,
        "cost_rad": None,
        "makespan_s": None,
        "cost_lower_bound_rad": straight,
        "cost_ratio": None,
        "min_clearance_m": None,
        "bound_met": None,
        "deadline_hit": tree.arms.clock.expired,
    }
    plan = None
    if best is not None:
        stats |= {
            "cost_rad": best.plan.cost_rad,
            "makespan_s": best.plan.makespan_s,
            "cost_ratio": best.plan.cost_rad / straight if straight > 0 else 1.0,
            "min_clearance_m": best.clearance,
            "bound_met": best.bound_met,
        }
        plan = dataclasses.replace(best.plan, planner=planner, stats=dict(stats))
    status = Status.SOLVED if plan else Status.EXHAUSTED if exhausted else Status.TIMEOUT
    stats["planning_time_s"] = time.perf_counter() - began
    return PlanResult(status=status, plan=plan, stats=stats)
