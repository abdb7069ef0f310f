"""The conflict tree as a graph that grows over the timeline `expansion`.

The expanded node is green, nodes expanded before it are greyish. Other colours show the number of conflicts of a node.
At the end the nodes from the root to the solution keep their colours. All colours are legible on the viewer's dark and
light background.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.sdk import require
from mmp_env.view.rerun.search_record import SearchRecord
from mmp_env.view.tree_drawing.node_text import branch_text, conflicts_text
from mmp_env.view.tree_layout import layout
from mmp_env.view.tree_record import TreeNode

TREE = "/tree"
MOST_LABELS = 80
"""Largest tree with visible labels; in a larger one a label appears under the mouse."""
MOST_ENTRIES = 200_000
"""Largest number of nodes times moments; for a larger tree not every expansion is a moment."""
FREE, FEW, MANY, UNKNOWN = (30, 120, 220), (150, 115, 0), (225, 50, 30), (122, 122, 122)
FAST_TRACK, EXPANDED = (210, 60, 150), (0, 138, 70)
"""Colours of nodes. A label has its node's colour on the theme's background, so all are about halfway between black and
white: the contrast ratio is at least 4.2 on both themes. The largest possible value is 4.4."""
_DIM, _DIMMED, _GAMMA = 0.7, UNKNOWN, 2.2
"""Share of grey in the colour of a finished node."""
_SOLUTION_SIZE, _FAST_TRACK_SIZE, _EXPANDED_SIZE, _DONE_SIZE = 1.45, 1.25, 1.45, 0.75
"""Factors of the radius of a circle."""
EXPANDED_MARK = "▶ "
_WORDS_WIDE = 30
_LABEL_ROOM, _RADIUS, _ACROSS, _DOWN = (190.0, 80.0), 13.0, 40.0, 45.0


def send_tree(stream: Any, record: SearchRecord) -> None:
    """Sends nodes and edges at each moment; ids are the planner's node numbers, prefixed if these are not unique."""
    nodes = record.tree.nodes
    if not nodes:
        return
    rerun, ids = require(), node_ids(nodes)
    labelled = len(nodes) <= MOST_LABELS
    points = positions(record.tree.parents, labelled)
    fixed: dict[str, Any] = {"positions": points.astype(np.float32), "show_labels": labelled}
    if not labelled:
        fixed["labels"] = [label(node) for node in nodes]
    stream.log(TREE, rerun.GraphNodes.from_fields(**fixed), static=True)
    stream.log(TREE, rerun.GraphEdges.from_fields(graph_type="directed"), static=True)
    moments, counts = growth(record)
    styles = NodeStyles(record, labelled)
    index = [timelines.sequence(timelines.EXPANSION, moments)]
    rows = [styles.at(moment, count) for moment, count in zip(moments, counts, strict=True)]
    columns: dict[str, Any] = {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
    grown = rerun.GraphNodes.columns(node_ids=[name for count in counts for name in ids[:count]], **columns)
    stream.send_columns(TREE, index, grown.partition(counts))
    edges = np.array([(ids[node.parent], ids[node.id]) for node in nodes if node.parent is not None]).reshape(-1, 2)
    if len(edges):
        before = np.cumsum([node.parent is not None for node in nodes])
        ends = [int(before[count - 1]) for count in counts]
        grown = rerun.GraphEdges.columns(edges=np.concatenate([edges[:end] for end in ends]))
        stream.send_columns(TREE, index, grown.partition(ends))
    stream.set_time(timelines.PLAN_TIME, duration=0.0)
    stream.log(TREE, rerun.GraphNodes.from_fields(node_ids=ids, **rows[-1]))
    if len(edges):
        stream.log(TREE, rerun.GraphEdges.from_fields(edges=edges))
    stream.reset_time()


def node_ids(nodes: Sequence[TreeNode]) -> list[str]:
    """Returns the planner's number of each node, with the number of the restart if numbers occur twice."""
    numbers = [node.number for node in nodes]
    if len(set(numbers)) == len(numbers):
        return [str(number) for number in numbers]
    return [f"{node.restart}/{node.number}/{node.id}" for node in nodes]


def positions(parents: Sequence[int | None], labelled: bool) -> Float[np.ndarray, "n 2"]:
    """Returns the positions of the nodes [n, 2] in units of the view, which are pixels at full size."""
    points = layout(parents, width=max(24.0, 2 * float(np.sqrt(len(parents)))))
    if labelled:
        return points * _LABEL_ROOM
    wide, high = np.maximum(np.ptp(points, axis=0), 1.0)
    # As wide as high, unless that needs edges that are much too long.
    across = np.clip(_DOWN * high / wide, _ACROSS, 10 * _ACROSS)
    return points * (across, np.clip(across * wide / (2 * high), _DOWN, 10 * _DOWN))


def growth(record: SearchRecord) -> tuple[list[int], list[int]]:
    """Returns the moments on the timeline, the last one after all expansions, and the number of nodes at each."""
    created = np.array(record.created_at)
    moments = np.arange(record.count + 2)
    counts = np.searchsorted(created, moments, side="right")
    stride = max(1, int(np.ceil(counts.sum() / MOST_ENTRIES)))
    if stride > 1:
        moments = np.unique([*moments[::stride], moments[-1]])
        counts = np.searchsorted(created, moments, side="right")
    kept = counts > 0
    return moments[kept].tolist(), counts[kept].tolist()


class NodeStyles:
    """Colours, radii and, if the tree is `labelled`, labels of the nodes at a moment."""

    def __init__(self, record: SearchRecord, labelled: bool) -> None:
        nodes = record.tree.nodes
        self._record = record
        self._bright = _conflict_colors([node.conflicts for node in nodes])
        self._bright[[node.fast_track for node in nodes]] = FAST_TRACK
        self._radii = np.array([_radius(node) for node in nodes])
        self._labels = np.array([label(node) for node in nodes]) if labelled else None
        self._done_at = np.array([node.expanded or np.inf for node in nodes])
        self._restart = np.array([node.restart for node in nodes])
        self._off_solution_path = np.array([not node.on_solution_path for node in nodes])

    def at(self, moment: int, count: int) -> dict[str, Any]:
        """Returns the fields of `GraphNodes` of the first `count` nodes.

        The node expanded last is green, large and marked with an arrow. Nodes expanded before it, and those of earlier
        trees, are greyish and small. After the last expansion this holds for all nodes off the solution path.
        """
        record, colors, radii = self._record, self._bright.copy(), self._radii.copy()
        if moment > record.count:
            done = self._off_solution_path if record.tree.solution is not None else np.zeros(len(colors), bool)
        else:
            done = (self._done_at <= moment) | (self._restart < self._restart[max(count - 1, 0)])
        colors[done] = _mixed(colors[done], _DIMMED, _DIM)
        radii[done] *= _DONE_SIZE
        expanded = record.tree.expansions[moment - 1] if 0 < moment <= record.count else None
        if expanded is not None:
            colors[expanded], radii[expanded] = EXPANDED, _RADIUS * _EXPANDED_SIZE
        out = {"colors": np.rint(colors[:count]).astype(np.uint8), "radii": radii[:count].astype(np.float32)}
        if self._labels is None:
            return out
        marked = [f"{EXPANDED_MARK}{text}" if k == expanded else text for k, text in enumerate(self._labels[:count])]
        return out | {"labels": np.array(marked)}


def label(node: TreeNode) -> str:
    """Returns the label of a node: its number, its conflicts, and what its branch forbids."""
    star = "★ " if node.on_solution_path else ""
    lines = [f"{star}{node.number}: {conflicts_text(node)}"]
    if node.fast_track:
        lines += branch_text(node).split(": ")
    elif node.constraint:
        lines += textwrap.wrap(node.constraint, _WORDS_WIDE)
    elif node.parent is None:
        lines.append("root" if node.restart == 0 else f"root of tree {node.restart + 1}")
    return "\n".join(lines)


def _radius(node: TreeNode) -> float:
    """Returns a radius that is larger on the solution path and slightly larger for the fast track."""
    return _RADIUS * (_SOLUTION_SIZE if node.on_solution_path else _FAST_TRACK_SIZE if node.fast_track else 1.0)


def _conflict_colors(conflicts: Sequence[int | None]) -> Float[np.ndarray, "n 3"]:
    """Returns colours from ochre to red by the square root of the number; blue for no conflict."""
    numbers = np.array([np.nan if number is None else number for number in conflicts], dtype=float)
    most = max(float(np.nanmax(numbers, initial=1.0)), 2.0)
    share = np.sqrt((np.maximum(numbers, 1.0) - 1.0) / (most - 1.0))
    out = _mixed(np.array(FEW), MANY, share[:, None])
    out[numbers == 0] = FREE
    out[np.isnan(numbers)] = UNKNOWN
    return out


def _mixed(one: np.ndarray, other: tuple[int, int, int], share: float | np.ndarray) -> np.ndarray:
    """Mixes colours in linear light: the mixture of two equally bright colours is as bright."""
    light = (1 - share) * (one / 255) ** _GAMMA + share * (np.array(other) / 255) ** _GAMMA
    return 255 * light ** (1 / _GAMMA)
