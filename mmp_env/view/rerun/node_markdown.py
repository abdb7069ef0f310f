"""A node of the search as text in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from mmp_env.view.rerun.conflict_intervals import ConflictInterval
from mmp_env.view.rerun.search_record import RecordedNode, SearchRecord
from mmp_env.view.tree_drawing.node_text import branch_text, fast_track_texts
from mmp_env.wording import counted, markdown_escaped

_MOST_LINES = 12


def node_markdown(record: SearchRecord, look: RecordedNode, intervals: Sequence[ConflictInterval]) -> str:
    """Returns which node this is, what its branch forbids, its cost, its lower bound and its conflicts."""
    created, node = look.created, record.tree.nodes[look.node]
    if look.expansion == 0:
        title = "The root: every arm on its own"
    elif look.expansion > record.count:
        title = f"The solution, node {created.node}"
    else:
        title = f"Expansion {look.expansion}: node {created.node}"
    lines = [f"## {title}", ""]
    if created.constraint:
        lines.append(f"- branch: **{markdown_escaped(created.constraint)}**")
    if created.fast_track:
        lines.append(f"- {markdown_escaped(branch_text(node))}")
    if created.parent is not None:
        lines.append(f"- parent: node {created.parent}")
    if node.restart:
        lines.append(f"- in tree number {node.restart + 1}")
    lines.append(f"- cost {created.cost_rad:.2f} rad, lower bound {created.lower_bound_rad:.2f} rad")
    lines += [f"- {markdown_escaped(text)}" for text in fast_track_texts(node)]
    if look.expansion > record.count and record.tree.clearance_m is not None:
        clear = f"{1e3 * record.tree.clearance_m:.1f} mm"
        lines.append(
            f"- clearance: at least {clear} at every instant by the planner's proof; `mmp check` may prove more"
        )
    pairs = f" between {counted(created.conflicting_pairs, 'pair')} of arms" if created.conflicts else ""
    lines.append(f"- conflicts: {created.conflicts}{pairs}")
    if node.conflict and look.conflict:
        lines.append(f"- branched on: **{markdown_escaped(node.conflict)}**")
    lines.append("")
    for interval in intervals[:_MOST_LINES]:
        begin, end = interval.first * created.dt_s, interval.last * created.dt_s
        when = f"{begin:.1f}" if begin == end else f"{begin:.1f} to {end:.1f}"
        depth = f", {1e3 * interval.depth_m:.0f} mm deep" if interval.depth_m > 0 else ", nearly touching"
        arms = markdown_escaped(f"{interval.arm_a} and {interval.arm_b}")
        lines.append(f"  - {arms}, {when} s{depth}")
    if len(intervals) > _MOST_LINES:
        lines.append(f"  - and {len(intervals) - _MOST_LINES} more")
    return "\n".join(lines)
