"""Text about a conflict tree and its nodes."""

from __future__ import annotations

import math

from mmp_env.view.tree_record import TreeNode, TreeRecord
from mmp_env.wording import counted


def conflicts_text(node: TreeNode) -> str:
    """Returns the number of conflicts."""
    if node.conflicts is None:
        return "unknown"
    if node.conflicts == 0:
        return "no conflict"
    return counted(node.conflicts, "conflict")


def cost_text(node: TreeNode) -> str:
    """Returns the cost, or an empty text if the planner did not report it."""
    return "" if math.isnan(node.cost_rad) else f"{node.cost_rad:.2f} rad"


def branch_text(node: TreeNode) -> str:
    """Returns how a node differs from its parent."""
    if node.fast_track:
        return f"fast track: {node.arm} is pushed aside" if node.arm else "fast track: several arms are pushed aside"
    return node.constraint or ("" if node.parent is None else "made shorter")


def fast_track_texts(node: TreeNode) -> list[str]:
    """Returns a text for each arm that the fast track was tried with."""
    return [f"fast track with {arm}: {'solved' if solved else 'failed'}" for arm, solved in node.fast_tracks]


def node_tooltip(node: TreeNode) -> str:
    """Returns everything that is known about a node, one fact per line."""
    lines = [f"node {node.number}" + (f", restart {node.restart}" if node.restart else "")]
    if branch_text(node):
        lines.append(branch_text(node))
    pairs = f" between {counted(node.conflicting_pairs, 'pair')} of arms" if node.conflicting_pairs else ""
    lines.append(conflicts_text(node) + pairs if node.conflicts is not None else "")
    lines.append(f"cost {cost_text(node)}" if cost_text(node) else "")
    lines.append("" if math.isnan(node.lower_bound_rad) else f"lower bound {node.lower_bound_rad:.2f} rad")
    lines.append(f"expanded as number {node.expanded}" if node.expanded else "not expanded")
    lines.append(f"branched on: {node.conflict}" if node.conflict else "")
    lines += fast_track_texts(node)
    lines.append("" if node.created_s is None else f"created after {node.created_s:.3f} s")
    lines.append("on the path to the solution" if node.on_solution_path else "")
    return "\n".join(line for line in lines if line)


def tree_summary(tree: TreeRecord) -> str:
    """Returns the result of the search in one line."""
    if not tree.nodes:
        return "no node: an arm found no path even alone, or the planner reports no search"
    nodes = counted(len(tree.nodes), "node")
    parts = [f"{nodes} in {len(tree.roots)} trees" if len(tree.roots) > 1 else nodes]
    if tree.expansions:
        parts.append(f"{len(tree.expansions)} expanded")
    parts.append("no solution" if tree.solution is None else _solution(tree))
    return "; ".join(parts)


def solution_path_texts(tree: TreeRecord) -> list[str]:
    """Returns the steps from the root to the solution."""
    out = []
    for node in tree.solution_path:
        step = branch_text(node) or "every arm on its own"
        out.append(f"{step}: {conflicts_text(node)}" if len(tree.solution_path) > 1 else conflicts_text(node))
    return out


def _solution(tree: TreeRecord) -> str:
    assert tree.solution is not None
    text = f"solution {cost_text(tree.solution)}".rstrip()
    straight = tree.problem.cost_lower_bound_rad if tree.problem else 0.0
    if straight > 0 and not math.isnan(tree.solution.cost_rad):
        text += f", {tree.solution.cost_rad / straight:.3f} x the straight lines"
    return text
