"""Repulsive trajectory modification (ModifyMotion of APF-ECBS, arXiv 2509.13882): options and call of the native core.

The descent itself is native (`native/repulsion/modify_motion.hpp`); the tests have its slow reference
implementation, which reads like the formula.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from mmp_env import core
from mmp_env.events import ForceField
from mmp_planners.planning_context import PairConflicts, Path, PlanningContext
from mmp_planners.seeds import seed_of

_DEFAULT = core.RepulsionSettings()


@dataclass(frozen=True, kw_only=True, eq=False)
class Modified:
    """A path after repulsion, the number of accepted iterations, the traced iterates, and the force field."""

    path: Path
    iterations: int = 0
    iterates: tuple[np.ndarray, ...] = ()
    field: ForceField | None = None


@runtime_checkable
class Modification(Protocol):
    """Modifies the path of an arm after replanning; None leaves it as it is."""

    def __call__(
        self, context: PlanningContext, paths: Sequence[Path], arm: int, constraints: Sequence[core.Constraint]
    ) -> Modified | None: ...


@dataclass(frozen=True, kw_only=True)
class NoModification:
    """Leaves the path as the low level made it, as plain ECBS does."""

    def __call__(
        self, context: PlanningContext, paths: Sequence[Path], arm: int, constraints: Sequence[core.Constraint]
    ) -> Modified | None:
        return None


@dataclass(frozen=True, kw_only=True)
class RepulsiveModification:
    """Moves a path away from the other arms by gradient descent.

    Force on step k: sum over sphere pairs with d <= d0 of J_p^T k_rep (1/d - 1/d0) / d^2 (p - o)/|p - o|;
    q_{n+1} = q_n + alpha * force, at most `max_iterations` times, with fixed ends. The descent ends at an iterate in
    static or self collision. It passes through iterates that violate a constraint, but does not return them.

    The values of `alpha` and `k_rep` are the paper's, those of `d0` [m] and `max_iterations` are ours. With normalised
    steps alpha and k_rep change nothing: a step has the size `step_rad` [rad] along the force. `distance`: d is
    measured between sphere surfaces (`surface`), or between centres (`centre`, paper-literal). `step`: `gradient`
    (paper-literal), or `normalised` with forces smoothed over time. Below `floor` [m] the force is constant, no joint
    moves more than `cap` [rad] per iteration, and the descent ends where two waypoints would be farther apart than
    `stretch` steps at full speed; 0 takes each of these away (paper-literal). Where convex pieces are closer than
    `exact_within` [m], the force between two links has the direction between their nearest points. A step that would
    end the descent is halved first, up to `halvings` times. `early_stop` ends the descent without conflicts and at 2
    cm of clearance. With `parked_yield` an arm that has arrived is repelled too, as long as another arm moves, and
    returns. `trace` keeps every iterate for watchers.
    """

    alpha: float = _DEFAULT.alpha
    k_rep: float = _DEFAULT.k_rep
    d0: float = _DEFAULT.d0
    max_iterations: int = _DEFAULT.max_iterations
    distance: str = "surface"
    step: str = "normalised"
    step_rad: float = _DEFAULT.normalised_step
    floor: float = _DEFAULT.floor
    cap: float = _DEFAULT.max_step
    stretch: float = _DEFAULT.stretch
    exact_within: float = _DEFAULT.exact_within
    halvings: int = _DEFAULT.halvings
    early_stop: bool = True
    parked_yield: bool = False
    trace: bool = False

    def __call__(
        self, context: PlanningContext, paths: Sequence[Path], arm: int, constraints: Sequence[core.Constraint]
    ) -> Modified | None:
        last = max(path.last for path in paths) if self.parked_yield else 0
        modified = core.modify_motion(
            context.core,
            context.until(paths[arm], arm, last).motion,
            others=[path.motion for k, path in enumerate(paths) if k != arm],
            constraints=constraints,
            max_step_rad=context.max_step[arm],
            levels=context.keep_levels(),
            constraint_margin=context.problem.margin,
            settings=self._settings,
            clock=context.clock,
            trace=self.trace,
        )
        if not modified.moved:
            return None
        field = ForceField(k_rep=self.k_rep, d0=self.d0, centres=self.distance == "centre")
        rows, iterates = modified.positions, tuple(modified.trace)
        if self.parked_yield:
            away = np.flatnonzero((rows != rows[-1]).any(axis=1))
            if not away.size:
                return None  # the move is too small for single precision
            rows = rows[: away[-1] + 2]  # it stands after its last move
        path = context.path(arm, rows)
        return Modified(path=path, iterations=modified.iterations, iterates=iterates, field=field)

    @property
    def _settings(self) -> core.RepulsionSettings:
        stop = {} if self.early_stop else {"comfort": -1.0}
        return core.RepulsionSettings(
            k_rep=self.k_rep,
            d0=self.d0,
            centre_distance=self.distance == "centre",
            alpha=self.alpha,
            max_iterations=self.max_iterations,
            normalised=self.step == "normalised",
            normalised_step=self.step_rad,
            floor=self.floor,
            max_step=self.cap,
            stretch=self.stretch,
            exact_within=self.exact_within,
            halvings=self.halvings,
            **stop,
        )


@dataclass(frozen=True, kw_only=True)
class ShortenedModification:
    """Shortens each path that a modification returns. The short path is clear of every arm that the modified path is.

    The single-arm planner starts from the modified path. We keep the modified path if the new one is not shorter or
    has more conflicts. The iterations of this are not counted.
    """

    modification: Modification

    def __call__(
        self, context: PlanningContext, paths: Sequence[Path], arm: int, constraints: Sequence[core.Constraint]
    ) -> Modified | None:
        modified = self.modification(context, paths, arm, constraints)
        if modified is None:
            return None
        before = _conflicts(context, paths, arm, modified.path)
        touched = {other for pair in before for other in pair}
        clear = [path for k, path in enumerate(paths) if k != arm and k not in touched]
        seed = seed_of(arm, modified.path.last)
        path, _ = context.low_level(arm, constraints, seed, others=clear, experience=modified.path.q)
        if path is None or path.length >= modified.path.length:
            return modified
        after = _conflicts(context, paths, arm, path)
        if sum(map(len, after.values())) > sum(map(len, before.values())):
            return modified
        return dataclasses.replace(modified, path=path)


def _conflicts(context: PlanningContext, paths: Sequence[Path], arm: int, path: Path) -> PairConflicts:
    """Returns the conflicts of one arm with another path."""
    return context.conflicts((*paths[:arm], path, *paths[arm + 1 :]), context.pairs(arm))


def traced(modification: Modification) -> Modification:
    """Returns the modification with `trace` on, if it has iterates."""
    return _with(modification, trace=True)


def yielding(modification: Modification) -> Modification:
    """Returns the modification with `parked_yield` on, if it repels."""
    return _with(modification, parked_yield=True)


def _with(modification: Modification, **options: bool) -> Modification:
    if isinstance(modification, RepulsiveModification):
        return dataclasses.replace(modification, **options)
    if isinstance(modification, ShortenedModification):
        return dataclasses.replace(modification, modification=_with(modification.modification, **options))
    return modification
