"""What the search looked at, node by node on the timeline `expansion`: paths, conflicts, clouds and words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.clouds import send_clouds
from mmp_env.view.rerun.colors import CONTACT, arm_colors
from mmp_env.view.rerun.meetings import Contact, Meetings, configurations
from mmp_env.view.rerun.record import Look, Record
from mmp_env.view.rerun.sdk import require
from mmp_env.view.rerun.words import describe

NODE = "/node"
PATHS, CONFLICTS, SPHERES, WORDS = f"{NODE}/paths", f"{NODE}/conflicts", f"{NODE}/spheres", f"{NODE}/words"
SEARCH = "/search"
SERIES = {"cost": (0, 114, 178), "lower bound": (0, 158, 115), "conflicts": (213, 94, 0), "open nodes": (130, 130, 130)}


def send_expansions(stream: Any, record: Record) -> None:
    """A row for the root, for each node that was expanded, and for the solution after the last one."""
    looks = shown(record)
    if not looks:
        return
    problem, meetings = record.problem, Meetings(record.problem)
    contacts = [meetings(look.told.paths) for look in looks]
    numbers = [look.expansion for look in looks]
    index = [timelines.sequence(timelines.EXPANSION, numbers)]
    _send_paths(stream, index, problem, looks)
    _send_contacts(stream, index, problem, looks, contacts)
    _send_instants(stream, index, problem, looks, contacts)
    words = [describe(record, look, met) for look, met in zip(looks, contacts, strict=True)]
    rerun = require()
    media = ["text/markdown"] * len(words)
    stream.send_columns(WORDS, index, rerun.TextDocument.columns(text=words, media_type=media))
    _say_where_it_ends(stream, record)
    stream.set_time(timelines.PLAN_TIME, duration=0.0)
    stream.log(WORDS, rerun.TextDocument(words[-1], media_type="text/markdown"))
    stream.reset_time()


def shown(record: Record) -> list[Look]:
    """The root before anything happened, then what was expanded, then the solution, each at a time of its own."""
    out = [record.root] if record.root else []
    out += record.looks
    if record.solution:
        solution, last = record.solution, record.count + 1
        out.append(Look(expansion=last, node=solution.node, told=solution.told))
    return out


def _say_where_it_ends(stream: Any, record: Record) -> None:
    """After the last node that was kept nothing is shown, rather than that node for ever."""
    if len(record.looks) == record.count:
        return
    rerun, kept = require(), len(record.looks)
    stream.set_time(timelines.EXPANSION, sequence=kept + 1)
    which = "expanded node is" if kept == 1 else f"{kept} expanded nodes are"
    words = f"## Expansion {kept + 1} and later\n\nOnly the first {which} recorded in detail."
    stream.log(WORDS, rerun.TextDocument(words, media_type="text/markdown"))
    for path in (PATHS, CONFLICTS, SPHERES):
        stream.log(path, rerun.Clear(recursive=True))
    stream.reset_time()


def send_progress(stream: Any, record: Record) -> None:
    """Cost, lower bound and conflicts of each expanded node, and how many are open, as curves over the search."""
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


def _send_paths(stream: Any, index: list[Any], problem: Problem, looks: Sequence[Look]) -> None:
    rerun, strips = require(), {}
    for name, color in arm_colors(problem.cell).items():
        rows = []
        for look in looks:
            path = look.told.paths[name]
            if id(path) not in strips:  # children have all paths but one from their parent
                strips[id(path)] = problem.cell.collision.tool_points(name, path).astype(np.float32)
            rows.append(strips[id(path)])
        entity = f"{PATHS}/{name}"
        stream.log(entity, rerun.LineStrips3D.from_fields(colors=[color], radii=[0.004]), static=True)
        stream.send_columns(entity, index, rerun.LineStrips3D.columns(strips=rows))


def _send_contacts(
    stream: Any, index: list[Any], problem: Problem, looks: Sequence[Look], contacts: Sequence[Sequence[Contact]]
) -> None:
    rerun = require()
    points = np.array([c.point for met in contacts for c in met], dtype=np.float32).reshape(-1, 3)
    labels = [
        f"{c.arm_a} and {c.arm_b}, {c.step * look.told.dt_s:.1f} s"
        for look, met in zip(looks, contacts, strict=True)
        for c in met
    ]
    lengths = [len(met) for met in contacts]
    # Labels are for the mouse: shown all at once they hide what they are about, and the words list them.
    look = rerun.Points3D.from_fields(colors=[CONTACT], radii=[0.03], show_labels=[False])
    stream.log(CONFLICTS, look, static=True)
    stream.send_columns(CONFLICTS, index, rerun.Points3D.columns(positions=points, labels=labels).partition(lengths))


def _send_instants(
    stream: Any, index: list[Any], problem: Problem, looks: Sequence[Look], contacts: Sequence[Sequence[Contact]]
) -> None:
    """All arms as they stand where the conflict that was chosen is deepest; in the middle where there is none."""
    steps = [instant(look, met) for look, met in zip(looks, contacts, strict=True)]
    q = {
        name: np.concatenate(
            [configurations(look.told.paths[name], np.array([step])) for look, step in zip(looks, steps, strict=True)]
        )
        for name in problem.cell.arm_names
    }
    send_clouds(stream, SPHERES, index, problem.cell, q, problem.conflict_distances)


def instant(look: Look, contacts: Sequence[Contact]) -> float:
    """The step at which a node is shown."""
    if not contacts:
        return (max(len(path) for path in look.told.paths.values()) - 1) / 2
    chosen = look.conflict
    if chosen is not None:
        for contact in contacts:
            if {contact.arm_a, contact.arm_b} == {chosen.arm_a, chosen.arm_b}:
                return contact.step
    return contacts[0].step
