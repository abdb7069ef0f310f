"""A cell with a camera before it: pictures of the arms in any configuration, and of the ways of their tools."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.sim.arm_colors import arm_color
from mmp_env.sim.rendering import Camera, Line
from mmp_env.sim.simulation import Simulation

WIDTH, HEIGHT = 640, 480
_STEP_RAD = 0.05
"""Between two points of a tool's way no joint moves farther."""
_NEAR_M = 0.004
"""Points that are this close to the straight line between others are left out of a way."""
_AHEAD_ALPHA = 0.5
_PASSED_M, _AHEAD_M = 0.014, 0.008
"""Thickness of a way, where it is done and where it is yet to come."""

State = Mapping[str, Float[np.ndarray, " dof"]]


class Studio:
    """Pictures of a cell of `width` x `height` pixels; a context. Raises `MmpError` where none can be made.

    The points `shown` [m] fill a picture, by default all that the arms can reach. `fine` pictures have shadows and
    smooth edges, and take several times as long without a graphics card.
    """

    def __init__(
        self,
        cell: Cell,
        width: int = WIDTH,
        height: int = HEIGHT,
        *,
        fine: bool = True,
        shown: Float[np.ndarray, "p 3"] | None = None,
    ) -> None:
        self.cell = cell
        self._simulation = Simulation(cell)
        self._camera = Camera(self._simulation, width, height, fine=fine, shown=shown)

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.close()

    def picture(self, q: State, goal: State | None = None, lines: Sequence[Line] = ()) -> UInt8[np.ndarray, "h w 3"]:
        """The arms at `q`, as ghosts at `goal`, arm -> [dof] [rad], and `lines`; a fresh array."""
        simulation = self._simulation
        simulation.place(simulation.joined(q))
        return self._camera.show(None if goal is None else simulation.joined(goal), lines)


def standing(plan: Plan, time_s: float) -> dict[str, Float[np.ndarray, "dof"]]:
    """Where all arms of the plan's cell are at that time; those that it does not move are at their start."""
    return {**plan.problem.start, **plan.at(time_s)}


def tool_ways(plan: Plan, time_s: float | None = None) -> list[Line]:
    """The ways of the tool points in the arms' colours, what comes after `time_s` [s] fainter."""
    times = plan.finer_times(_STEP_RAD)
    split = len(times) if time_s is None else int(np.searchsorted(times, time_s))
    if time_s is not None:
        times = np.insert(times, split, min(time_s, plan.makespan_s))
    out, q = [], plan.sampled(times)
    for number, name in enumerate(plan.problem.cell.arm_names):
        if name not in q:
            continue
        points = plan.problem.cell.collision.tool_points(name, q[name])
        for part, alpha, thickness in ((points[: split + 1], 1.0, _PASSED_M), (points[split:], _AHEAD_ALPHA, _AHEAD_M)):
            if len(part) > 1:
                line = Line(points=_simplified(part), rgba=(*arm_color(number), alpha), thickness=thickness)
                out.append(line)
    return out


def _simplified(points: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "m 3"]:
    """Fewer points, from which none of those left out is farther than `_NEAR_M` (after Douglas and Peucker, 1973)."""
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    stack = [(0, len(points) - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        along = points[last] - points[first]
        inner = points[first + 1 : last] - points[first]
        share = np.clip(inner @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        distances = np.linalg.norm(inner - share[:, None] * along, axis=1)
        farthest = int(distances.argmax())
        if distances[farthest] > _NEAR_M:
            keep[first + 1 + farthest] = True
            stack += [(first, first + 1 + farthest), (first + 1 + farthest, last)]
    return points[keep]
