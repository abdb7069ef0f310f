"""The conflict tree as a graph that grows over the timeline `expansion`.

White is the node at hand, dim what is done with. Colours say how many conflicts a node has; at the end the way from the
root to the solution stays bright.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.rerun import timelines
from mmp_env.rerun.record import Record
from mmp_env.rerun.sdk import require
from mmp_env.search_tree import TreeNode
from mmp_env.tree_drawing.telling import conflicts_in_words, edge_in_words
from mmp_env.tree_layout import layout

TREE = "/tree"
MOST_LABELS = 80
"""Larger trees have circles without words; these are shown where the mouse is."""
MOST_ENTRIES = 200_000
"""Nodes times moments that are written; of a larger tree not every expansion is a moment."""
_FREE, _FEW, _MANY, _UNKNOWN = (80, 190, 255), (255, 244, 170), (255, 105, 30), (150, 150, 150)
_FAST_TRACK = (255, 110, 190)
_AT_HAND, _ON_THE_WAY, _OF_THE_FAST_TRACK = (255, 255, 255), 1.45, 1.25
_DIM, _DIMMED = 0.55, (120, 124, 130)
"""A dim colour is so much of this grey, which leaves words in it legible on the dark background."""
_WORDS_WIDE = 30
_LABEL_ROOM, _RADIUS, _ACROSS, _DOWN = (190.0, 80.0), 13.0, 40.0, 45.0


def send_tree(stream: Any, record: Record) -> None:
    """Nodes and edges at each moment; ids are the planner's node numbers, with the tree's where they come again."""
    nodes = record.tree.nodes
    if not nodes:
        return
    rerun, ids = require(), node_ids(nodes)
    labelled = len(nodes) <= MOST_LABELS
    places = positions(record.tree.parents, labelled)
    look = rerun.GraphNodes.from_fields(
        positions=places.astype(np.float32),
        labels=[label(node) for node in nodes],
        show_labels=labelled,
        radii=[_radius(node) for node in nodes],
    )
    stream.log(TREE, look, static=True)
    stream.log(TREE, rerun.GraphEdges.from_fields(graph_type="directed"), static=True)
    moments, counts = growth(record)
    shades = Shades(record)
    colors = [shades.at(moment)[:count] for moment, count in zip(moments, counts, strict=True)]
    index = [timelines.sequence(timelines.EXPANSION, moments)]
    grown = rerun.GraphNodes.columns(
        node_ids=[name for count in counts for name in ids[:count]], colors=np.concatenate(colors)
    )
    stream.send_columns(TREE, index, grown.partition(counts))
    edges = np.array([(ids[node.parent], ids[node.id]) for node in nodes if node.parent is not None]).reshape(-1, 2)
    if len(edges):
        before = np.cumsum([node.parent is not None for node in nodes])
        ends = [int(before[count - 1]) for count in counts]
        grown = rerun.GraphEdges.columns(edges=np.concatenate([edges[:end] for end in ends]))
        stream.send_columns(TREE, index, grown.partition(ends))
    stream.set_time(timelines.PLAN_TIME, duration=0.0)
    stream.log(TREE, rerun.GraphNodes.from_fields(node_ids=ids, colors=colors[-1]))
    if len(edges):
        stream.log(TREE, rerun.GraphEdges.from_fields(edges=edges))
    stream.reset_time()


def node_ids(nodes: Sequence[TreeNode]) -> list[str]:
    """The planner's number of each node; with that of its tree where the planner begins anew."""
    numbers = [node.number for node in nodes]
    if len(set(numbers)) == len(numbers):
        return [str(number) for number in numbers]
    return [f"{node.restart}/{node.number}/{node.id}" for node in nodes]


def positions(parents: Sequence[int | None], labelled: bool) -> Float[np.ndarray, "n 2"]:
    """Where the nodes stand, in the units of the view, which are pixels at its full size."""
    places = layout(parents, width=max(24.0, 2 * float(np.sqrt(len(parents)))))
    if labelled:
        return places * _LABEL_ROOM
    wide, high = np.maximum(np.ptp(places, axis=0), 1.0)
    # As wide as high, where that does not take edges that are much too long.
    across = np.clip(_DOWN * high / wide, _ACROSS, 10 * _ACROSS)
    return places * (across, np.clip(across * wide / (2 * high), _DOWN, 10 * _DOWN))


def growth(record: Record) -> tuple[list[int], list[int]]:
    """Moments on the timeline, the last one being after all expansions, and how many nodes there are at each."""
    created = np.array(record.created_at)
    moments = np.arange(record.count + 2)
    counts = np.searchsorted(created, moments, side="right")
    stride = max(1, int(np.ceil(counts.sum() / MOST_ENTRIES)))
    if stride > 1:
        moments = np.unique([*moments[::stride], moments[-1]])
        counts = np.searchsorted(created, moments, side="right")
    kept = counts > 0
    return moments[kept].tolist(), counts[kept].tolist()


class Shades:
    """Colours of all nodes at a moment."""

    def __init__(self, record: Record) -> None:
        nodes = record.tree.nodes
        self._record = record
        self._bright = _conflict_colors([node.conflicts for node in nodes])
        self._bright[[node.fast_track for node in nodes]] = _FAST_TRACK
        self._expanded = np.array([node.expanded or np.inf for node in nodes])
        self._restart = np.array([node.restart for node in nodes])
        self._off_way = np.array([not node.on_solution_path for node in nodes])

    def at(self, moment: int) -> UInt8[np.ndarray, "n 3"]:
        """White is what was expanded last; dim what was before, and the trees before the present one.

        After the last expansion all but the way to the solution is dim.
        """
        record, colors = self._record, self._bright.copy()
        if moment > record.count:
            dim = self._off_way if record.tree.solution is not None else np.zeros(len(colors), bool)
        else:
            there = int(np.searchsorted(record.created_at, moment, side="right"))
            dim = (self._expanded <= moment) | (self._restart < self._restart[max(there - 1, 0)])
        colors[dim] += _DIM * (np.array(_DIMMED) - colors[dim])
        if 0 < moment <= record.count:
            colors[record.tree.expansions[moment - 1]] = _AT_HAND
        return np.rint(colors).astype(np.uint8)


def label(node: TreeNode) -> str:
    """What a node says: its number and conflicts, and below that what its branch forbids."""
    star = "★ " if node.on_solution_path else ""
    lines = [f"{star}{node.number}: {conflicts_in_words(node)}"]
    if node.fast_track:
        lines += edge_in_words(node).split(": ")
    elif node.constraint:
        lines += textwrap.wrap(node.constraint, _WORDS_WIDE)
    elif node.parent is None:
        lines.append("root" if node.restart == 0 else f"root of tree {node.restart + 1}")
    return "\n".join(lines)


def _radius(node: TreeNode) -> float:
    """Larger on the way to the solution, and a little where the fast track made it."""
    return _RADIUS * (_ON_THE_WAY if node.on_solution_path else _OF_THE_FAST_TRACK if node.fast_track else 1.0)


def _conflict_colors(conflicts: Sequence[int | None]) -> Float[np.ndarray, "n 3"]:
    """From yellow to orange as the root of the number; blue for none."""
    numbers = np.array([np.nan if number is None else number for number in conflicts], dtype=float)
    most = max(float(np.nanmax(numbers, initial=1.0)), 2.0)
    share = np.sqrt((np.maximum(numbers, 1.0) - 1.0) / (most - 1.0))
    out = np.array(_FEW) + share[:, None] * (np.array(_MANY) - np.array(_FEW, dtype=float))
    out[numbers == 0] = _FREE
    out[np.isnan(numbers)] = _UNKNOWN
    return out
