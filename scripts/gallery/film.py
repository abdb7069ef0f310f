"""The animation of the README: the conflicts of each node, the growing conflict tree, and the plan."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from gallery.cell_view import CellView
from gallery.fonts import ALARM, FAINT, INK, PAPER, font
from gallery.instances import Search, first_small
from gallery.tree_panel import TreePanel
from mmp_env import check_plan
from mmp_env.events import ConflictChosen, NodeCreated
from mmp_env.files.writing import whole_file
from mmp_env.model.conflict import Conflict, plan_conflicts
from mmp_env.model.plan import Plan
from mmp_env.view.offscreen_renderer import tool_path_lines
from mmp_env.view.tree_drawing.node_text import branch_text, conflicts_text

WIDTH, HEIGHT, PANEL, CAPTION = 840, 470, 306, 56
_CUT = (14, 26, 36, 0)
_FRAME_MS = 125
_LEAD_S = 1.2
"""Time [s] that is shown before a conflict."""
_LOOK_MS, _BRANCH_MS, _LAST_MS = 1400, 800, 2500
_RING = 24
_QUALITY = 48
_WHOLE = (20, 32)
"""Least and largest distance of key frames: more of them enlarge the file, fewer leave artefacts."""
_ROOT = "the root of the tree: every arm alone, without the others"

Picture = UInt8[np.ndarray, "h w 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """One picture of the animation and its duration [ms]."""

    picture: Picture
    duration_ms: int


def save_search(path: Path) -> None:
    """Writes the animation of the first small search, as an endless WebP."""
    shots = list(film(first_small()))
    write_webp(path, shots, quality=_QUALITY, method=4, kmin=_WHOLE[0], kmax=_WHOLE[1])
    seconds = sum(shot.duration_ms for shot in shots) / 1e3
    print(f"{path.name}: {len(shots)} pictures, {seconds:.1f} s")


def write_webp(path: Path, shots: list[Shot], **encoding: int) -> None:
    """Writes the shots to an endless WebP. `encoding` are options of Pillow for WebP files."""
    first, *rest = (Image.fromarray(shot.picture) for shot in shots)
    durations = [shot.duration_ms for shot in shots]
    with whole_file(path) as temporary:
        first.save(temporary, "WEBP", save_all=True, append_images=rest, duration=durations, loop=0, **encoding)


def film(
    run: Search, *, width: int = WIDTH, height: int = HEIGHT, frame_ms: int = _FRAME_MS, fine: bool = True
) -> Iterator[Shot]:
    """Yields the search node by node, and then the plan with a picture every `frame_ms` [ms]."""
    panel = TreePanel(run.tree, PANEL, height)
    with CellView(run.problem.cell, width - PANEL, height - CAPTION, _CUT, fine=fine) as view:
        yield from _searching(run, view, panel, frame_ms)
        yield from _moving(run, view, panel, frame_ms)


def _searching(run: Search, view: CellView, panel: TreePanel, frame_ms: int) -> Iterator[Shot]:
    """Yields the conflict of each node that is branched on, and then its children."""
    shown, last = 0, view.picture(run.problem.start)
    nodes = run.tree.nodes
    for event in run.events:
        if isinstance(event, NodeCreated):
            shown += 1
            node = nodes[shown - 1]
            if node.parent is None:
                words = (f"{len(run.problem.cell.arms)} paths, each planned alone: {node.conflicts} conflicts", _ROOT)
            elif node.fast_track:
                words = (
                    branch_text(node).capitalize(),
                    f"{conflicts_text(node)} is left" if node.conflicts == 0 else conflicts_text(node),
                )
            else:
                text = f"{node.constraint}: {node.conflicts} conflicts"
                words = (text, "replanned with the constraint, then pushed away from the others")
            tree = panel.picture(shown, node.id)
            yield Shot(picture=_joined(last, tree, *words), duration_ms=_BRANCH_MS)
        elif isinstance(event, ConflictChosen):
            plan = plan_of(run, event.node)
            conflict = _conflict_in_plan(plan, event)
            tree = panel.picture(shown, event.node)
            words = (
                f"Here {event.arm_a} and {event.arm_b} would collide",
                "two branches: one arm avoids the other, or the other one does",
            )
            for shot, ended in _until(view, plan, conflict, frame_ms):
                last = shot
                yield Shot(picture=_joined(shot, tree, *words), duration_ms=_LOOK_MS if ended else frame_ms)


def _until(view: CellView, plan: Plan, conflict: Conflict, frame_ms: int) -> Iterator[tuple[Picture, bool]]:
    """Yields the arms up to the deepest point of the conflict; the last picture has a ring around it."""
    end_s, point = deepest(plan, conflict)
    arms = (conflict.arm_a, conflict.arm_b)
    for time_s in np.arange(max(0.0, end_s - _LEAD_S), end_s - 1e-9, frame_ms / 1e3):
        yield view.picture(plan.at(float(time_s)), colored=arms), False
    yield ringed(view.picture(plan.at(end_s), colored=arms), view.pixel(point)), True


def _moving(run: Search, view: CellView, panel: TreePanel, frame_ms: int) -> Iterator[Shot]:
    """Yields the plan in real time, with the tool paths."""
    plan = run.plan
    tree = panel.picture(len(run.tree.nodes), solved=True)
    clearance = check_plan(plan).min_clearance_m or 0.0  # a returned plan has a clearance
    proved = f"proved: at every instant at least {math.floor(1e4 * clearance) / 10:.1f} mm between all bodies"
    times = np.append(np.arange(0.0, plan.makespan_s, frame_ms / 1e3), plan.makespan_s)
    for k, time_s in enumerate(times.tolist()):
        words = f"The plan: {time_s:.1f} of {plan.makespan_s:.1f} s"
        shot = view.picture(plan.at(time_s), tool_path_lines(plan, time_s))
        duration = _LAST_MS if k == len(times) - 1 else frame_ms
        yield Shot(picture=_joined(shot, tree, words, proved), duration_ms=duration)


def plan_of(run: Search, number: int) -> Plan:
    """Returns the paths of a node as a plan, in which arms that arrive early wait."""
    event = next(e for e in run.events if isinstance(e, NodeCreated) and e.node == number)
    count = max(len(path) for path in event.paths.values())
    padded = {arm: np.concatenate([q, np.repeat(q[-1:], count - len(q), axis=0)]) for arm, q in event.paths.items()}
    return Plan(problem=run.problem, times=event.dt_s * np.arange(count), positions=padded)


def _conflict_in_plan(plan: Plan, chosen: ConflictChosen) -> Conflict:
    """Returns the chosen conflict in the plan: that of the same arms which is closest in time."""
    found = plan_conflicts(plan.problem.cell.collision, plan)
    same = [c for c in found if {c.arm_a, c.arm_b} == {chosen.arm_a, chosen.arm_b}]
    return min(same, key=lambda c: abs(c.start_s - chosen.start_s))


def deepest(plan: Plan, conflict: Conflict) -> tuple[float, Float[np.ndarray, "3"]]:
    """Returns when the conflict is deepest [s], and the point between the two spheres [m]."""
    model = plan.problem.cell.collision
    times = np.linspace(conflict.start_s, conflict.end_s, 50)
    apart = [np.abs(plan.at(float(t))[conflict.arm_a] - conflict.q_a).max() for t in times]
    one, other = (
        model.spheres(arm, q[None])[0][0][k]
        for arm, q, k in zip(
            (conflict.arm_a, conflict.arm_b), (conflict.q_a, conflict.q_b), conflict.spheres, strict=True
        )
    )
    return float(times[int(np.argmin(apart))]), (one + other) / 2


def ringed(picture: Picture, place: tuple[float, float]) -> Picture:
    image = Image.fromarray(picture).convert("RGB")
    finer = image.resize((2 * image.width, 2 * image.height), Image.Resampling.BICUBIC)
    x, y = (2 * side for side in place)
    ImageDraw.Draw(finer).ellipse([x - 2 * _RING, y - 2 * _RING, x + 2 * _RING, y + 2 * _RING], outline=ALARM, width=9)
    return np.array(finer.resize(image.size, Image.Resampling.BOX))


def _joined(cell: Picture, tree: Picture, words: str, more: str) -> Picture:
    """Returns cell and caption on the left, the tree on the right."""
    caption = Image.new("RGB", (cell.shape[1], CAPTION), PAPER)
    draw = ImageDraw.Draw(caption)
    draw.text((14, 18), words, INK, font(15, bold=True), anchor="lm")
    draw.text((14, 40), more, FAINT, font(12.5), anchor="lm")
    return np.concatenate([np.concatenate([cell, np.array(caption)]), tree], axis=1)
