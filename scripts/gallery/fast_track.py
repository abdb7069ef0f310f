"""A hit of the fast track: two arms at the deepest point of their conflict before the repulsion, and after it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from gallery.cell_view import CellView
from gallery.film import Picture, deepest, plan_of, ringed
from gallery.fonts import FAINT, INK, PAPER, font
from gallery.instances import SEEDS, Search, search
from mmp_env import MmpError
from mmp_env.events import FastTracked, NodeCreated
from mmp_env.files.writing import whole_file
from mmp_env.model.conflict import plan_conflicts
from mmp_env.model.plan import Plan
from mmp_env.sim.rendering import Line
from mmp_env.view.offscreen_renderer import tool_path_lines

ARMS = 4
PAPER_FAST_TRACK = {
    "fast_track": "literal",
    "fast_track_at": "expansion",
    "critical_arms": "one",
    "misses": "discarded",
}
"""The fast track as the paper has it: one critical arm, and a success replaces the node."""
_SIZE, _WHOLE, _CAPTION = (420, 360), (1000, 780), 56
_FORMER = (0.35, 0.35, 0.35, 0.6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Hit:
    """A successful attempt of the fast track on a node with one pair of arms in conflict."""

    run: Search
    node: int
    critical: str
    other: str
    before: Plan
    after: Plan
    time_s: float
    point: np.ndarray

    def clearance_m(self, plan: Plan) -> float:
        """Returns the clearance [m] of the two arms at the instant of the conflict."""
        q, model = plan.at(self.time_s), plan.problem.cell.collision
        one, other = self.critical, self.other
        return float(model.pair_clearance(one, q[one][None], other, q[other][None], precise=True)[0])

    def sentence(self) -> str:
        """Returns what the picture shows."""
        before, after = (1e3 * self.clearance_m(plan) for plan in (self.before, self.after))
        one, other = self.critical, self.other
        return (
            f"Seed {self.run.seed} of `{self.run.problem.cell.name}`: at {self.time_s:.2f} s the spheres of {one} and "
            f"{other} overlap by {-before:.0f} mm, and after the repulsion of {one} they are {after:.0f} mm apart."
        )


def save_fast_track(path: Path) -> None:
    """Writes the picture of the first hit, and prints what it shows."""
    hit = first_hit()
    with whole_file(path) as temporary:
        Image.fromarray(hit_picture(hit)).save(temporary, "WEBP", quality=84, method=6)
    print(f"{path.name}: {hit.sentence()}")


def first_hit(seeds: Iterable[int] = SEEDS, arms: int = ARMS) -> Hit:
    """Returns the first hit of the paper's fast track on the seeds of a ring. Raises `MmpError` if there is none."""
    for seed in seeds:
        run = search("apf-ecbs", seed, arms, PAPER_FAST_TRACK)
        found = next((event for event in run.events if isinstance(event, FastTracked) and event.solved), None)
        if found is not None:
            return _hit(run, found)
    raise MmpError("the fast track has no hit on any of the seeds")


def _hit(run: Search, found: FastTracked) -> Hit:
    made = [event for event in run.events if isinstance(event, NodeCreated)]
    moved = next(event.node for event in made if event.fast_track and event.parent == found.node)
    before, after = plan_of(run, found.node), plan_of(run, moved)
    (critical,) = found.arms
    conflict = max(plan_conflicts(run.problem.cell.collision, before), key=lambda conflict: conflict.depth_m)
    time_s, point = deepest(before, conflict)
    other = conflict.arm_b if conflict.arm_a == critical else conflict.arm_a
    return Hit(
        run=run,
        node=found.node,
        critical=critical,
        other=other,
        before=before,
        after=after,
        time_s=time_s,
        point=point,
    )


def hit_picture(hit: Hit, *, size: tuple[int, int] = _SIZE, whole: tuple[int, int] = _WHOLE) -> Picture:
    """Returns both panels side by side; the right one has the former tool path of the critical arm in grey."""
    width, height = size
    panels = []
    with CellView(hit.run.problem.cell, *whole) as view:
        x, y = view.pixel(hit.point)
        left = int(np.clip(x - width / 2, 0, whole[0] - width))
        top = int(np.clip(y - height / 3, 0, whole[1] - height))
        former = _line(hit.before, hit.critical)
        former = Line(points=former.points, rgba=_FORMER, thickness=former.thickness)
        for plan, more in ((hit.before, []), (hit.after, [former])):
            lines = [_line(plan, arm) for arm in (hit.critical, hit.other)]
            picture = view.picture(plan.at(hit.time_s), [*lines, *more], colored=(hit.critical, hit.other))
            picture = ringed(picture, (x, y))[top : top + height, left : left + width]
            panels.append(np.concatenate([picture, _caption(hit, plan, width)]))
    return np.concatenate(panels, axis=1)


def _line(plan: Plan, arm: str) -> Line:
    return tool_path_lines(plan)[plan.problem.cell.arm_names.index(arm)]


def _caption(hit: Hit, plan: Plan, width: int) -> Picture:
    """Returns two lines of text about the node before or after the repulsion."""
    clearance = 1e3 * hit.clearance_m(plan)
    apart = f"{clearance:.0f} mm apart" if clearance > 0 else f"overlap by {-clearance:.0f} mm"
    words = "before" if plan is hit.before else f"after the repulsion of {hit.critical}"
    image = Image.new("RGB", (width, _CAPTION), PAPER)
    draw = ImageDraw.Draw(image)
    draw.text((14, 18), f"Node {hit.node} {words}", INK, font(15, bold=True), anchor="lm")
    draw.text(
        (14, 40), f"{hit.critical} and {hit.other} at {hit.time_s:.2f} s: {apart}", FAINT, font(12.5), anchor="lm"
    )
    return np.array(image)
