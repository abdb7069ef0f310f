"""What a drawing says of a tree and of its nodes, in words."""

from __future__ import annotations

import math

from mmp_env.view.tree_record import TreeNode, TreeRecord
from mmp_env.wording import counted


def conflicts_in_words(node: TreeNode) -> str:
    """How many there are."""
    if node.conflicts is None:
        return "not told"
    if node.conflicts == 0:
        return "no conflict"
    return counted(node.conflicts, "conflict")


def cost_in_words(node: TreeNode) -> str:
    """Its cost, nothing where the planner did not tell it."""
    return "" if math.isnan(node.cost_rad) else f"{node.cost_rad:.2f} rad"


def edge_in_words(node: TreeNode) -> str:
    """What sets a node apart from its parent."""
    if node.fast_track:
        return f"fast track: {node.arm} is pushed aside"
    return node.constraint or ("" if node.parent is None else "made shorter")


def fast_tracks_in_words(node: TreeNode) -> list[str]:
    """Each arm that the fast track was tried with."""
    return [f"fast track with {arm}: {'solved' if solved else 'in vain'}" for arm, solved in node.fast_tracks]


def everything(node: TreeNode) -> str:
    """All that is known of a node, a line each."""
    lines = [f"node {node.number}" + (f", restart {node.restart}" if node.restart else "")]
    if edge_in_words(node):
        lines.append(edge_in_words(node))
    pairs = f" between {counted(node.conflicting_pairs, 'pair')} of arms" if node.conflicting_pairs else ""
    lines.append(conflicts_in_words(node) + pairs if node.conflicts is not None else "")
    lines.append(f"cost {cost_in_words(node)}" if cost_in_words(node) else "")
    lines.append("" if math.isnan(node.lower_bound_rad) else f"lower bound {node.lower_bound_rad:.2f} rad")
    lines.append(f"expanded as number {node.expanded}" if node.expanded else "not expanded")
    lines.append(f"branched on: {node.conflict}" if node.conflict else "")
    lines += fast_tracks_in_words(node)
    lines.append("" if node.created_s is None else f"made after {node.created_s:.3f} s")
    lines.append("on the way to the solution" if node.on_solution_path else "")
    return "\n".join(line for line in lines if line)


def summary(tree: TreeRecord) -> str:
    """What became of the search, in one line."""
    if not tree.nodes:
        return "no node: an arm found no way even alone, or the planner tells nothing of its search"
    nodes = counted(len(tree.nodes), "node")
    parts = [f"{nodes} in {len(tree.roots)} trees" if len(tree.roots) > 1 else nodes]
    if tree.expansions:
        parts.append(f"{len(tree.expansions)} expanded")
    parts.append("no solution" if tree.solution is None else _solution(tree))
    return "; ".join(parts)


def way_in_words(tree: TreeRecord) -> list[str]:
    """The steps from the root to the solution."""
    out = []
    for node in tree.solution_path:
        step = edge_in_words(node) or "every arm on its own"
        out.append(f"{step}: {conflicts_in_words(node)}" if len(tree.solution_path) > 1 else conflicts_in_words(node))
    return out


def _solution(tree: TreeRecord) -> str:
    assert tree.solution is not None
    text = f"solution {cost_in_words(tree.solution)}".rstrip()
    straight = tree.problem.cost_lower_bound_rad if tree.problem else 0.0
    if straight > 0 and not math.isnan(tree.solution.cost_rad):
        text += f", {tree.solution.cost_rad / straight:.3f} x the straight lines"
    return text
