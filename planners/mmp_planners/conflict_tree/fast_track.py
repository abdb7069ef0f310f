"""The fast track of APF-ECBS: repulsion of the critical arms of a node may resolve all its conflicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.node import MovedInVain, Node
from mmp_planners.conflict_tree.repulsion import Modification, RepulsiveModification
from mmp_planners.planning_context import Path, PlanningContext

EXACT_COVER_ARMS = 10
"""Largest number of arms in conflict for which the minimum vertex cover is searched exactly."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Node M: node N with the paths of `arms` modified.

    If M has no conflicts, it is a candidate for the plan. If M `replaces` node N, it takes the place of N in OPEN.
    """

    node: Node
    arms: tuple[int, ...]
    replaces: bool = False

    @property
    def solved(self) -> bool:
        return not self.node.conflicts


@runtime_checkable
class FastTrack(Protocol):
    """Makes attempts on a node with conflicts."""

    @property
    def on_children(self) -> bool:
        """Whether each child is tried as soon as it is planned. Any node not tried yet is tried before branching."""
        ...

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]: ...


@dataclass(frozen=True, kw_only=True)
class NoFastTrack:
    """Makes no attempt: the part of every other planner."""

    on_children: bool = False

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]:
        return iter(())


@dataclass(frozen=True, kw_only=True)
class RepulsiveFastTrack:
    """Repels each arm that is in every conflicting pair, in turn, until one attempt leaves no conflict.

    This is the fast track of the paper. `literal` is the paper-literal setting: a solution replaces the node, so the
    node cannot be branched any more.
    """

    modification: Modification
    literal: bool = False
    on_children: bool = False

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]:
        for arm in node.common_arms():
            modified = _modified(self.modification, context, node, arm)
            if modified is not None:
                yield Attempt(arms=(arm,), node=modified, replaces=self.literal and not modified.conflicts)


@dataclass(frozen=True, kw_only=True)
class RepulsionOfSeveralArms:
    """Repels several arms one after the other, each from the modified paths of those before it.

    The arms are those of a minimum vertex cover of the conflicting pairs (`cover`), or all arms in conflict. A modified
    path is kept if it leaves fewer conflicts. Rounds go on while a round leaves fewer. With `keep_misses` an attempt
    that leaves fewer conflicts than the node, but not none, replaces the node. A solution replaces it if `literal`.

    If every pair that is left in conflict has a conflict after one of its arms has arrived, rounds with `last_resort`
    follow. They are kept only if they leave no conflict.

    An arm that was moved in vain is left alone, in children too, until its own path or one within `reach` [m] of it has
    changed. What the last resort has moved in vain, only the last resort leaves alone.
    """

    modification: Modification
    last_resort: Modification | None = None
    reach: float = RepulsiveModification.d0
    literal: bool = False
    on_children: bool = False
    cover: bool = False
    keep_misses: bool = True

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]:
        vain, vain_resort = dict(node.vain), dict(node.vain_resort)
        modified, arms = self._rounds(context, node, self.modification, vain)
        if self.last_resort is not None and modified.conflicts and all(map(modified.is_late, modified.conflicts)):
            solution, more = self._rounds(context, modified, self.last_resort, vain_resort)
            if not solution.conflicts:
                modified, arms = solution, arms | more
        node.vain = modified.vain = vain
        node.vain_resort = modified.vain_resort = vain_resort
        if arms:
            replaces = self.keep_misses if modified.conflicts else self.literal
            yield Attempt(arms=tuple(sorted(arms)), node=modified, replaces=replaces)

    def _rounds(
        self, context: PlanningContext, node: Node, modification: Modification, vain: MovedInVain
    ) -> tuple[Node, set[int]]:
        """Returns the node after the last round, and the arms that were moved. Adds to `vain`."""
        current, moved, before = node, set[int](), node.conflict_count + 1
        while current.conflicts and current.conflict_count < before and not context.clock.expired:
            before = current.conflict_count
            for arm in vertex_cover(current.conflicts) if self.cover else by_degree(current.conflicts):
                then = vain.get(arm)
                if then is not None and not self._changed(context, arm, then, current.paths):
                    continue
                modified = _modified(modification, context, current, arm)
                if modified is not None and modified.conflict_count < current.conflict_count:
                    current = modified
                    moved.add(arm)
                else:
                    vain[arm] = current.paths
                if not current.conflicts:
                    break
        return current, moved

    def _changed(self, context: PlanningContext, arm: int, before: Sequence[Path], paths: Sequence[Path]) -> bool:
        """Returns whether the path of an arm, or one near it, is not as before."""
        changed = [k for k, (then, now) in enumerate(zip(before, paths, strict=True)) if then is not now]
        return any(
            k == arm or any(context.may_be_near(paths[arm], path, self.reach) for path in (before[k], paths[k]))
            for k in changed
        )


def _modified(modification: Modification, context: PlanningContext, node: Node, arm: int) -> Node | None:
    """Returns the node with the path of one arm modified, or None if the modification moves nothing."""
    modified = modification(context, node.paths, arm, node.constraints[arm])
    if modified is None:
        return None
    paths, conflicts = node.replaced(context, arm, modified.path)
    return Node(
        id=node.id,
        parent=node.parent,
        paths=paths,
        constraints=node.constraints,
        bounds=node.bounds,
        conflicts=conflicts,
        fast_tracked=True,
        kinds=node.kinds,
    )


def by_degree(pairs: Iterable[tuple[int, int]]) -> list[int]:
    """Returns the arms of the pairs, the arm of most pairs first, then the lower id."""
    pairs = list(pairs)
    arms = sorted({arm for pair in pairs for arm in pair})
    return sorted(arms, key=lambda arm: -sum(arm in pair for pair in pairs))


def vertex_cover(pairs: Iterable[tuple[int, int]]) -> list[int]:
    """Returns the fewest arms of which every pair has one, ordered as by `by_degree`.

    With more than `EXACT_COVER_ARMS` arms, the arm of most pairs left is taken until no pair is left.
    """
    pairs = list(pairs)
    arms = by_degree(pairs)
    if len(arms) <= EXACT_COVER_ARMS:
        return next(
            list(chosen)
            for size in range(len(arms) + 1)
            for chosen in combinations(arms, size)
            if all(a in chosen or b in chosen for a, b in pairs)
        )
    chosen = []
    while pairs:
        chosen.append(by_degree(pairs)[0])
        pairs = [pair for pair in pairs if chosen[-1] not in pair]
    return chosen
