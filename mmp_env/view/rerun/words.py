"""A node in words."""

from __future__ import annotations

from collections.abc import Sequence

from mmp_env.view.rerun.meetings import Contact
from mmp_env.view.rerun.record import Look, Record
from mmp_env.view.tree_drawing.telling import edge_in_words, fast_tracks_in_words
from mmp_env.wording import counted, markdown_escaped

_MOST_LINES = 12


def describe(record: Record, look: Look, contacts: Sequence[Contact]) -> str:
    """Markdown: which node this is, what its branch forbids, its cost, bound and conflicts."""
    told, node = look.told, record.tree.nodes[look.node]
    if look.expansion == 0:
        title = "The root: every arm on its own"
    elif look.expansion > record.count:
        title = f"The solution, node {told.node}"
    else:
        title = f"Expansion {look.expansion}: node {told.node}"
    lines = [f"## {title}", ""]
    if told.constraint:
        lines.append(f"- branch: **{markdown_escaped(told.constraint)}**")
    if told.fast_track:
        lines.append(f"- {markdown_escaped(edge_in_words(node))}")
    if told.parent is not None:
        lines.append(f"- parent: node {told.parent}")
    if node.restart:
        lines.append(f"- in tree number {node.restart + 1}")
    lines.append(f"- cost {told.cost_rad:.2f} rad, lower bound {told.lower_bound_rad:.2f} rad")
    lines += [f"- {markdown_escaped(words)}" for words in fast_tracks_in_words(node)]
    if look.expansion > record.count and record.tree.clearance_m is not None:
        clear = f"{1e3 * record.tree.clearance_m:.1f} mm"
        lines.append(
            f"- clearance: at least {clear} at every instant by the planner's proof; `mmp check` may prove more"
        )
    pairs = f" between {counted(told.conflicting_pairs, 'pair')} of arms" if told.conflicts else ""
    lines.append(f"- conflicts: {told.conflicts}{pairs}")
    if node.conflict and look.conflict:
        lines.append(f"- branched on: **{markdown_escaped(node.conflict)}**")
    lines.append("")
    for contact in contacts[:_MOST_LINES]:
        begin, end = contact.first * told.dt_s, contact.last * told.dt_s
        when = f"{begin:.1f}" if begin == end else f"{begin:.1f} to {end:.1f}"
        depth = f", {1e3 * contact.depth_m:.0f} mm deep" if contact.depth_m > 0 else ", nearly touching"
        arms = markdown_escaped(f"{contact.arm_a} and {contact.arm_b}")
        lines.append(f"  - {arms}, {when} s{depth}")
    if len(contacts) > _MOST_LINES:
        lines.append(f"  - and {len(contacts) - _MOST_LINES} more")
    return "\n".join(lines)
