"""The expanded nodes on the timeline `expansion`: paths, conflicts, sphere clouds and text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.colors import CONTACT, arm_colors
from mmp_env.view.rerun.conflict_intervals import ConflictFinder, ConflictInterval, configurations_at
from mmp_env.view.rerun.node_markdown import node_markdown
from mmp_env.view.rerun.sdk import entity_part, require
from mmp_env.view.rerun.search_record import RecordedNode, SearchRecord
from mmp_env.view.rerun.sphere_clouds import send_clouds

NODE = "/node"
PATHS, CONFLICTS, SPHERES, WORDS = f"{NODE}/paths", f"{NODE}/conflicts", f"{NODE}/spheres", f"{NODE}/words"
SEARCH = "/search"
SERIES = {"cost": (0, 114, 178), "lower bound": (0, 158, 115), "conflicts": (213, 94, 0), "open nodes": (130, 130, 130)}


def send_expansions(stream: Any, record: SearchRecord) -> None:
    """Sends a row for the root, for each expanded node, and for the solution after the last one."""
    nodes = shown(record)
    if not nodes:
        return
    problem, find_conflicts = record.problem, ConflictFinder(record.problem)
    intervals = [find_conflicts(node.created.paths) for node in nodes]
    numbers = [node.expansion for node in nodes]
    index = [timelines.sequence(timelines.EXPANSION, numbers)]
    _send_paths(stream, index, problem, nodes)
    _send_intervals(stream, index, nodes, intervals)
    _send_instants(stream, index, problem, nodes, intervals)
    words = [node_markdown(record, node, met) for node, met in zip(nodes, intervals, strict=True)]
    rerun = require()
    media = ["text/markdown"] * len(words)
    stream.send_columns(WORDS, index, rerun.TextDocument.columns(text=words, media_type=media))
    _say_where_it_ends(stream, record)
    stream.set_time(timelines.PLAN_TIME, duration=0.0)
    stream.log(WORDS, rerun.TextDocument(words[-1], media_type="text/markdown"))
    stream.reset_time()


def shown(record: SearchRecord) -> list[RecordedNode]:
    """Returns the root, the expanded nodes and the solution, each with an expansion number of its own."""
    out = [record.root] if record.root else []
    out += record.expanded_nodes
    if record.solution:
        solution, last = record.solution, record.count + 1
        out.append(RecordedNode(expansion=last, node=solution.node, created=solution.created))
    return out


def _say_where_it_ends(stream: Any, record: SearchRecord) -> None:
    """Clears the view after the last node that was kept, which would otherwise stay."""
    if len(record.expanded_nodes) == record.count:
        return
    rerun, kept = require(), len(record.expanded_nodes)
    stream.set_time(timelines.EXPANSION, sequence=kept + 1)
    which = "expanded node is" if kept == 1 else f"{kept} expanded nodes are"
    words = f"## Expansion {kept + 1} and later\n\nOnly the first {which} recorded in detail."
    stream.log(WORDS, rerun.TextDocument(words, media_type="text/markdown"))
    for path in (PATHS, CONFLICTS, SPHERES):
        stream.log(path, rerun.Clear(recursive=True))
    stream.reset_time()


def send_progress(stream: Any, record: SearchRecord) -> None:
    """Sends cost, lower bound and conflicts of each expanded node, and the number of open nodes, as curves."""
    rerun, tree = require(), record.tree
    expanded = [tree.nodes[node] for node in tree.expansions]
    numbers = list(range(1, len(expanded) + 1))
    if record.tree.nodes:
        expanded, numbers = [tree.nodes[0], *expanded], [0, *numbers]
    if tree.solution is not None:
        expanded, numbers = [*expanded, tree.solution], [*numbers, len(tree.expansions) + 1]
    last = record.open_nodes[-1] if record.open_nodes else 0
    values = {
        "cost": [node.cost_rad for node in expanded],
        "lower bound": [node.lower_bound_rad for node in expanded],
        "conflicts": [np.nan if node.conflicts is None else node.conflicts for node in expanded],
        "open nodes": [1, *record.open_nodes, *[last] * bool(tree.solution)][: len(numbers)],
    }
    index = [timelines.sequence(timelines.EXPANSION, numbers)]
    for name, column in values.items():
        path = f"{SEARCH}/{name.replace(' ', '_')}"
        stream.log(path, rerun.SeriesLines(names=[name], colors=[SERIES[name]], widths=[2.0]), static=True)
        if numbers:
            stream.send_columns(path, index, rerun.Scalars.columns(scalars=np.array(column, dtype=float)))


def _send_paths(stream: Any, index: list[Any], problem: Problem, nodes: Sequence[RecordedNode]) -> None:
    rerun, strips = require(), {}
    for name, color in arm_colors(problem.cell).items():
        rows = []
        for node in nodes:
            path = node.created.paths[name]
            if id(path) not in strips:  # children have all paths but one from their parent
                strips[id(path)] = problem.cell.collision.tool_points(name, path).astype(np.float32)
            rows.append(strips[id(path)])
        entity = f"{PATHS}/{entity_part(name)}"
        stream.log(entity, rerun.LineStrips3D.from_fields(colors=[color], radii=[0.004]), static=True)
        stream.send_columns(entity, index, rerun.LineStrips3D.columns(strips=rows))


def _send_intervals(
    stream: Any,
    index: list[Any],
    nodes: Sequence[RecordedNode],
    intervals: Sequence[Sequence[ConflictInterval]],
) -> None:
    rerun = require()
    points = np.array([c.point for met in intervals for c in met], dtype=np.float32).reshape(-1, 3)
    labels = [
        f"{c.arm_a} and {c.arm_b}, {c.step * node.created.dt_s:.1f} s"
        for node, met in zip(nodes, intervals, strict=True)
        for c in met
    ]
    lengths = [len(met) for met in intervals]
    # Labels appear under the mouse only: all of them together would hide the scene, and the text lists them.
    look = rerun.Points3D.from_fields(colors=[CONTACT], radii=[0.03], show_labels=[False])
    stream.log(CONFLICTS, look, static=True)
    stream.send_columns(CONFLICTS, index, rerun.Points3D.columns(positions=points, labels=labels).partition(lengths))


def _send_instants(
    stream: Any,
    index: list[Any],
    problem: Problem,
    nodes: Sequence[RecordedNode],
    intervals: Sequence[Sequence[ConflictInterval]],
) -> None:
    """Sends all arms where the chosen conflict is deepest, or in the middle of the path if there is none."""
    steps = [np.array([instant(node, met)]) for node, met in zip(nodes, intervals, strict=True)]
    q = {
        name: np.concatenate(
            [configurations_at(node.created.paths[name], step) for node, step in zip(nodes, steps, strict=True)]
        )
        for name in problem.cell.arm_names
    }
    send_clouds(stream, SPHERES, index, problem.cell, q, problem.conflict_distances)


def instant(node: RecordedNode, intervals: Sequence[ConflictInterval]) -> float:
    """Returns the step at which a node is shown."""
    if not intervals:
        return (max(len(path) for path in node.created.paths.values()) - 1) / 2
    chosen = node.conflict
    if chosen is not None:
        for interval in intervals:
            if {interval.arm_a, interval.arm_b} == {chosen.arm_a, chosen.arm_b}:
                return interval.step
    return intervals[0].step
