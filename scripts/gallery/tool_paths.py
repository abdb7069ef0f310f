"""Draws the tool paths of one plan of each planner from above, on the instance of the animation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from planner_tables import PLANNERS

from gallery.instances import ARMS, Search, first_small, search
from mmp_env.files.writing import write_text
from mmp_env.model.plan import Plan
from mmp_env.view.offscreen_renderer import tool_path_lines
from mmp_env.view.tree_drawing.svg import element

_SIDE, _BORDER = 116.0, 6.0
_PAPER, _FRAME, _CASING, _BASE = "#f4f5f6", "#c4c9cf", "#1f2429", "#9aa3ad"


def save_tool_paths(folder: Path) -> None:
    """Writes `paths-<planner>.svg` for the planners of the README, all in the same scale."""
    shown = first_small()
    runs = [search(planner, shown.seed, ARMS) for planner in PLANNERS]
    for run, text in zip(runs, drawings(runs), strict=True):
        write_text(folder / f"paths-{run.planner}.svg", text)


def drawings(runs: Sequence[Search]) -> list[str]:
    """Returns one SVG text per run, all in the same scale."""
    lines = [tool_path_lines(run.plan) for run in runs]
    points = np.concatenate([line.points[:, :2] for drawn in lines for line in drawn])
    low, high = points.min(axis=0), points.max(axis=0)
    scale = (_SIDE - 2 * _BORDER) / float((high - low).max())
    middle = (low + high) / 2

    def placed(point: np.ndarray) -> tuple[float, float]:
        x, y = _SIDE / 2 + scale * (point[:2] - middle) * (1, -1)
        return float(x), float(y)

    out = []
    for run, drawn in zip(runs, lines, strict=True):
        content = [element("circle", cx=x, cy=y, r=2.4, fill=_BASE) for x, y in map(placed, _bases(run.plan))]
        for line in drawn:
            path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in map(placed, line.points))
            color = "#" + "".join(f"{round(255 * part):02x}" for part in line.rgba[:3])
            round_ends = {"fill": "none", "stroke_linecap": "round", "stroke_linejoin": "round"}
            content.append(element("path", d=path, stroke=_CASING, stroke_width=2.2, stroke_opacity=0.55, **round_ends))
            content.append(element("path", d=path, stroke=color, stroke_width=1.6, **round_ends))
            x, y = placed(line.points[-1])
            content.append(element("circle", cx=x, cy=y, r=2.6, fill=color, stroke=_CASING, stroke_width=0.8))
        out.append(_page(content, f"{run.planner}: top view of the tool paths"))
    return out


def _bases(plan: Plan) -> list[np.ndarray]:
    return [np.asarray(arm.position) for arm in plan.problem.cell.arms]


def _page(content: list[str], description: str) -> str:
    side = f"{_SIDE:.0f}"
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{side}" height="{side}" viewBox="0 0 {side} {side}">',
            element("title", description),
            element("rect", x=0.5, y=0.5, width=_SIDE - 1, height=_SIDE - 1, rx=5, fill=_PAPER, stroke=_FRAME),
            *content,
            "</svg>\n",
        )
    )
