"""Repulsive modifications on the timeline `repulsion`: one step per iteration, one modification after the other.

The view has all spheres at one time, the forces on those of the arm, its tool path before, now and after, and the
clearance of the path. Arms that exert no force are pale.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.colors import AFTER, BEFORE, CONTACT, FORCE, arm_colors, pale
from mmp_env.view.rerun.repulsion_steps import RepulsionSteps, repulsion_steps
from mmp_env.view.rerun.sdk import require
from mmp_env.view.rerun.search_record import SearchRecord
from mmp_env.view.rerun.sphere_clouds import contact_colors
from mmp_env.wording import counted, markdown_escaped

REPULSION = "/repulsion"
ARM, OTHERS, FORCES = f"{REPULSION}/arm", f"{REPULSION}/others", f"{REPULSION}/forces"
PATH_BEFORE, PATH_NOW, PATH_AFTER = (f"{REPULSION}/path/{name}" for name in ("before", "now", "after"))
WORDS, CLEARANCE = "/repulsion_words", "/repulsion_clearance"
LONGEST_M = 0.3
"""Length [m] of the arrow of the largest force on a path; the others scale with the cube root of their force."""


def send_repulsions(stream: Any, record: SearchRecord) -> None:
    """Sends all modifications that were kept, with a gap of one number on the timeline between two of them."""
    every = [repulsion_steps(record.problem, repulsion) for repulsion in record.repulsions]
    if not every:
        return
    sizes = [len(steps.paths) for steps in every]
    firsts = np.cumsum([0, *(size + 1 for size in sizes[:-1])]).tolist()
    numbers = [list(range(first, first + size)) for first, size in zip(firsts, sizes, strict=True)]
    all_rows = _index(every, numbers)
    first_rows = _index(every, [rows[:1] for rows in numbers])
    _send_arm(stream, all_rows, record.problem, every)
    _send_others(stream, first_rows, record.problem, every)
    _send_paths(stream, all_rows, first_rows, record.problem, every)
    rerun = require()
    words = [iteration_markdown(steps, k) for steps in every for k in range(len(steps.paths))]
    media = ["text/markdown"] * len(words)
    stream.send_columns(WORDS, all_rows, rerun.TextDocument.columns(text=words, media_type=media))
    stream.log(CLEARANCE, rerun.SeriesLines(names=["clearance [m]"], colors=[CONTACT]), static=True)
    index = [timelines.sequence(timelines.REPULSION, [n for rows in numbers for n in [*rows, rows[-1] + 1]])]
    curve = np.concatenate([[*steps.nearest, np.nan] for steps in every])  # nan: a gap between two paths
    stream.send_columns(CLEARANCE, index, rerun.Scalars.columns(scalars=curve))


def iteration_markdown(steps: RepulsionSteps, k: int) -> str:
    """Returns an iteration of a modification as text in Markdown."""
    created, count = steps.repulsion.created, steps.repulsion.expansion
    title = "the path of the low level" if k == 0 else f"iteration {k} of {len(steps.paths) - 1}"
    clear, force = 1e3 * steps.nearest[k], float(np.linalg.norm(steps.forces[k], axis=1).max())
    by = f" by {markdown_escaped(', '.join(sorted(steps.pushing)))}" if steps.pushing else ""
    lines = [
        f"## {markdown_escaped(steps.arm)}: {title}",
        "",
        f"- for node {created.node}, made after {counted(count, 'expansion')}",
        *([f"- branch: **{markdown_escaped(created.constraint)}**"] if created.constraint else []),
        f"- shown at {steps.instant * created.dt_s:.1f} s, where the arm is closest to another one; pushed{by}",
        f"- the whole path is {clear:.0f} mm clear" if clear > 0 else f"- the whole path: {-clear:.0f} mm in contact",
        f"- largest force on a sphere: {force:.2g}" if force else "- no force",
        "",
        "Tool path: grey before, black after, coloured now. Arrows: forces, as long as their cube root.",
    ]
    return "\n".join(lines)


def arrows(forces: Float[np.ndarray, "n s 3"]) -> Float[np.ndarray, "n s 3"]:
    """Returns the arrows [m] that show the forces."""
    size = np.linalg.norm(forces, axis=2, keepdims=True)
    largest = size.max(initial=0.0)
    return LONGEST_M * np.cbrt(size / largest) * forces / np.maximum(size, 1e-300) if largest > 0 else forces


def _index(every: Sequence[RepulsionSteps], numbers: Sequence[Sequence[int]]) -> list[Any]:
    """Returns the rows on `repulsion`, with their positions on `expansion` and on `plan time`."""
    rows = [(number, steps.repulsion.expansion) for steps, mine in zip(every, numbers, strict=True) for number in mine]
    return [
        timelines.sequence(timelines.REPULSION, [number for number, _ in rows]),
        timelines.sequence(timelines.EXPANSION, [expansion for _, expansion in rows]),
        timelines.seconds([0.0] * len(rows)),
    ]


def _send_arm(stream: Any, index: list[Any], problem: Problem, every: Sequence[RepulsionSteps]) -> None:
    """Sends the spheres of the arm, and arrows that begin on their surfaces."""
    rerun, colors = require(), arm_colors(problem.cell)
    radii = [problem.cell.collision.spheres(steps.arm, steps.paths[0, :1])[1] for steps in every]
    look = rerun.Points3D.columns(
        positions=np.concatenate([steps.centers.reshape(-1, 3) for steps in every]).astype(np.float32),
        colors=np.concatenate([contact_colors(colors[steps.arm], steps.touching).reshape(-1, 3) for steps in every]),
        radii=np.concatenate([np.tile(r, len(steps.paths)) for steps, r in zip(every, radii, strict=True)]),
    )
    stream.send_columns(ARM, index, look.partition([len(row) for steps in every for row in steps.centers]))
    origins, vectors, lengths = [], [], []
    for steps, r in zip(every, radii, strict=True):
        for centers, force, arrow in zip(steps.centers, steps.forces, arrows(steps.forces), strict=True):
            felt = force.any(axis=1)
            away = force[felt] / np.linalg.norm(force[felt], axis=1, keepdims=True)
            origins.append(centers[felt] + r[felt, None] * away)
            vectors.append(arrow[felt])
            lengths.append(int(felt.sum()))
    stream.log(FORCES, rerun.Arrows3D.from_fields(colors=[FORCE], radii=[0.006]), static=True)
    both = rerun.Arrows3D.columns(origins=np.concatenate(origins), vectors=np.concatenate(vectors))
    stream.send_columns(FORCES, index, both.partition(lengths))


def _send_others(stream: Any, index: list[Any], problem: Problem, every: Sequence[RepulsionSteps]) -> None:
    """Sends the other arms, which stand still while this one is modified."""
    rerun, model, colors = require(), problem.cell.collision, arm_colors(problem.cell)
    positions, radii, painted, lengths = [], [], [], []
    for steps in every:
        for name, q in steps.others.items():
            centers, sizes = model.spheres(name, q[None])
            color = colors[name] if name in steps.pushing else pale(colors[name])
            positions.append(centers[0])
            radii.append(sizes)
            painted.append(np.tile(color, (len(sizes), 1)))
        lengths.append(sum(len(model.sphere_links(name)) for name in steps.others))
    if not positions:
        return
    look = rerun.Points3D.columns(
        positions=np.concatenate(positions).astype(np.float32),
        radii=np.concatenate(radii),
        colors=np.concatenate(painted),
    )
    stream.send_columns(OTHERS, index, look.partition(lengths))


def _send_paths(
    stream: Any, all_rows: list[Any], first_rows: list[Any], problem: Problem, every: Sequence[RepulsionSteps]
) -> None:
    rerun, colors, model = require(), arm_colors(problem.cell), problem.cell.collision
    now: list[np.ndarray] = []
    before, after = [], []
    for steps in every:
        count, length, dof = steps.paths.shape
        points = model.tool_points(steps.arm, steps.paths.reshape(-1, dof)).astype(np.float32)
        now += list(points.reshape(count, length, 3))
        before.append(now[-count])
        after.append(model.tool_points(steps.arm, steps.repulsion.repelled.after).astype(np.float32))
    of_arm = [colors[steps.arm] for steps in every for _ in steps.paths]
    for path, index, strips, color, radius in (
        (PATH_BEFORE, first_rows, before, [BEFORE] * len(before), 0.004),
        (PATH_NOW, all_rows, now, of_arm, 0.006),
        (PATH_AFTER, first_rows, after, [AFTER] * len(after), 0.003),
    ):
        stream.log(path, rerun.LineStrips3D.from_fields(radii=[radius]), static=True)
        stream.send_columns(path, index, rerun.LineStrips3D.columns(strips=strips, colors=color))
