"""Conflict trees made from given events."""

from __future__ import annotations

from mmp_env.events import ConflictChosen, FastTracked, NodeCreated, NodeExpanded, SearchStarted, SolutionFound
from mmp_env.view.search_tree import SearchTree


def created(number, parent=None, *, arm="left", constraint="left avoids right at 2.0 s", conflicts=3, **more):
    """Returns the event of a node. A node without a parent has no arm and no constraint."""
    if parent is None:
        arm = constraint = None
    fields = {"cost_rad": 10.0 + number, "lower_bound_rad": 9.0, "conflicting_pairs": 1, "paths": {}}
    fields |= {"node": number, "parent": parent, "arm": arm, "constraint": constraint, "conflicts": conflicts}
    return NodeCreated(elapsed_s=0.5, **fields | more)


def expanded(number, conflicts=3):
    return NodeExpanded(elapsed_s=0.5, node=number, open_nodes=1, expanded_nodes=1, conflicts=conflicts)


def branched(number):
    return ConflictChosen(elapsed_s=0.5, node=number, arm_a="left", arm_b="right", start_s=2.0, end_s=2.5)


def fast_tracked(number, solved=True):
    return FastTracked(elapsed_s=0.5, node=number, arms=("left",), solved=solved)


def solved(number, cost_rad):
    return SolutionFound(elapsed_s=0.6, node=number, cost_rad=cost_rad, clearance_m=0.004)


def started(restart):
    return SearchStarted(elapsed_s=0.0, restart=restart, sub_seed=1)


def grown(parents, *, constraints=None, conflicts=None, fast_tracks=(), solution=None, title="a tree"):
    """Returns a tree with these parents. All nodes with children are expanded."""
    tree = SearchTree(title=title)
    for number, parent in enumerate(parents):
        if parent is None:
            tree(started(sum(p is None for p in parents[:number])))
        fields = {} if constraints is None else {"constraint": constraints[number]}
        fields |= {"constraint": None} if number in fast_tracks else {}
        count = 3 if conflicts is None else conflicts[number]
        tree(created(number, parent, conflicts=count, fast_track=number in fast_tracks, **fields))
    for number in sorted({parent for parent in parents if parent is not None}):
        tree(expanded(number))
    if solution is not None:
        tree(solved(solution, 10.0 + solution))
    return tree


def forest(rng, count, trees=1):
    """Returns the parents of `count` nodes, each among the last few before it. The first of each tree has none."""
    firsts = {0, *(int(k) for k in rng.choice(max(count, 1), size=min(trees - 1, count), replace=False))}
    out, begin = [], 0
    for node in range(count):
        if node in firsts:
            begin = node
            out.append(None)
        else:
            out.append(int(rng.integers(max(begin, node - 12), node)))
    return out
