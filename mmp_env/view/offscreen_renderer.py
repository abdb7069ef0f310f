"""Pictures of a cell without a window: arms in any configuration, tool paths, and what a picture must show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.argument_checks import whole
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.opengl import MAX_PIXELS
from mmp_env.sim.arm_colors import arm_color
from mmp_env.sim.camera_view import GivenView, as_camera_view
from mmp_env.sim.rendering import Camera, Line
from mmp_env.sim.scene_appearance import camera_pose, corners, is_ground
from mmp_env.sim.simulation import Simulation

WIDTH, HEIGHT = 640, 480
WIDE = 2.0
"""Least ratio of width to height of what a picture shows for which its height follows."""
_LEAST_HEIGHT = 64
"""Least height [px] of a picture of a wide cell."""
_STEP_RAD = 0.05
"""Largest joint motion [rad] between two points of a tool path."""
_NEAR_M = 0.004
"""Largest distance [m] of an omitted point of a tool path from the line that replaces it."""
_AHEAD_ALPHA = 0.5
_PASSED_M, _AHEAD_M = 0.014, 0.008
"""Thickness [m] of a tool path before and after the moment that is shown."""
_MOST_MOMENTS = 60
"""Number of moments of a plan that its outline is computed from."""
_BESIDE_M = 0.15
"""Width [m] of the strip around the arms in which obstacles are shown."""

State = Mapping[str, Float[np.ndarray, " dof"]]


class OffscreenRenderer:
    """Renders pictures of a cell without a window; a context manager.

    Args:
        cell: the cell.
        width: width of a picture [px].
        height: height of a picture [px].
        fine: whether pictures have shadows and smooth edges. Without a graphics card they take several times as long.
        shown: points [p, 3] that a picture must contain [m]; by default everything that the arms can reach.
        camera: a view, its name or its numbers, see `as_camera_view`; by default obliquely from above.

    Raises:
        MmpError: for a camera or a size that is not allowed; `picture` raises it where no OpenGL library is found.
    """

    def __init__(
        self,
        cell: Cell,
        width: int = WIDTH,
        height: int = HEIGHT,
        *,
        fine: bool = True,
        shown: Float[np.ndarray, "p 3"] | None = None,
        camera: GivenView = None,
    ) -> None:
        view = as_camera_view(camera)
        self.cell = cell
        self._simulation = Simulation(cell)
        self._camera = Camera(self._simulation, width, height, fine=fine, shown=shown, view=view)

    def __enter__(self) -> OffscreenRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.close()

    def picture(self, q: State, goal: State | None = None, lines: Sequence[Line] = ()) -> UInt8[np.ndarray, "h w 3"]:
        """Returns a picture of the arms at `q` and, transparent, at `goal`, arm -> [dof] [rad], with `lines`."""
        simulation = self._simulation
        simulation.place(simulation.joined(q))
        return self._camera.show(None if goal is None else simulation.joined(goal), lines)


def fitting_height(shown: Float[np.ndarray, "p 3"], width: int, camera: GivenView = None) -> int:
    """Returns the usual height [px] of a picture, or less if what it shows is more than `WIDE` times as wide as high.

    Args:
        shown: points [p, 3] that the picture must contain [m].
        width: width of the picture [px].
        camera: a view, its name or its numbers, see `as_camera_view`. With a distance the height is the usual one.

    Raises:
        MmpError: for a width or a camera that is not allowed.
    """
    whole("width", width, 1, MAX_PIXELS)
    view = as_camera_view(camera)
    if view is not None and view.distance is not None:
        return HEIGHT
    eye, axes = camera_pose(shown, axes=None if view is None else view.axes)
    right, up, back = ((shown - eye) @ axes).T
    ratio = float(np.ptp(right / -back) / max(np.ptp(up / -back), 1e-9))
    even = 2 * round(width / ratio / 2)
    return HEIGHT if ratio <= WIDE else int(np.clip(even, _LEAST_HEIGHT, HEIGHT))


def configuration_at(plan: Plan, time_s: float) -> dict[str, Float[np.ndarray, "dof"]]:
    """Returns arm -> configuration [rad] of all arms at that time; arms that the plan lacks are at their start."""
    return {**plan.problem.start, **plan.at(time_s)}


def tool_path_lines(plan: Plan, time_s: float | None = None) -> list[Line]:
    """Returns the tool paths as lines in the arms' colours; the part after `time_s` [s] is fainter."""
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
    """Returns fewer points; no omitted point is farther from the lines than `_NEAR_M` (Douglas and Peucker, 1973)."""
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


def plan_outline(plan: Plan) -> Float[np.ndarray, "p 3"]:
    """Returns the points [p, 3] that a picture of the plan must contain [m].

    They surround the arms along the plan and the obstacles near them. The table or floor below the arms does not count.
    """
    cell, start = plan.problem.cell, plan.problem.start
    positions = plan.sampled(np.linspace(0.0, plan.makespan_s, _MOST_MOMENTS))
    arms = np.concatenate([_around(cell, name, positions.get(name, start[name][None])) for name in cell.arm_names])
    low, high = arms.min(axis=0) - _BESIDE_M, arms.max(axis=0) + _BESIDE_M
    things = [corners(obstacle) for obstacle in cell.obstacles if not is_ground(cell, obstacle)]
    near = [part for part in things if (part.max(axis=0) >= low).all() and (part.min(axis=0) <= high).all()]
    return np.concatenate([arms, *(np.clip(part, low, high) for part in near)])


def _around(cell: Cell, arm: str, q: Float[np.ndarray, "k dof"]) -> Float[np.ndarray, "p 3"]:
    """Returns the six outermost points of every sphere of an arm at the configurations `q` [rad]."""
    centers, radii = cell.collision.spheres(arm, np.ascontiguousarray(q))
    offsets = radii[:, None, None] * np.concatenate([np.eye(3), -np.eye(3)])
    return (centers[:, :, None] + offsets).reshape(-1, 3)
