"""Pictures of the cell beside a conflict tree: some arms in colour, the others pale."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.model.cell import Cell
from mmp_env.sim.rendering import Camera, Line
from mmp_env.sim.scene_appearance import CAMERA, TABLE_RGBA, frame, outline
from mmp_env.sim.simulation import Simulation

_PALE = 0.8
"""Share of the table's colour in that of a pale arm."""


class CellView:
    """Renders pictures of `width` x `height` pixels, cropped by `cut` (left, top, right, bottom); a context manager.

    The camera's own picture has room for arms that are fully stretched.
    """

    def __init__(
        self,
        cell: Cell,
        width: int,
        height: int,
        cut: tuple[int, int, int, int] = (0, 0, 0, 0),
        *,
        fine: bool = True,
    ) -> None:
        left, top, right, bottom = cut
        whole = (width + left + right, height + top + bottom)
        self._window = np.s_[top : top + height, left : left + width]
        self._corner, self._whole = np.array([left, top]), np.array(whole)
        self._simulation = Simulation(cell)
        self._camera = Camera(self._simulation, *whole, fine=fine)
        self._colors = self._simulation.model.mat_rgba.copy()
        fixed = self._simulation.data.camera(CAMERA)
        self._eye, self._axes = fixed.xpos.copy(), fixed.xmat.reshape(3, 3).copy()
        self._sides = frame(outline(cell), self._eye, self._axes, whole[0] / whole[1])

    def __enter__(self) -> CellView:
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.close()

    def picture(
        self,
        q: Mapping[str, Float[np.ndarray, " dof"]],
        lines: Sequence[Line] = (),
        colored: Collection[str] | None = None,
    ) -> UInt8[np.ndarray, "h w 3"]:
        """Returns a picture of the arms at `q`. Arms that are not in `colored` are pale; by default none is."""
        model = self._simulation.model
        model.mat_rgba[:] = self._colors
        for k in range(model.nmat):
            if colored is not None and model.mat(k).name.partition("/")[0] not in colored:
                model.mat_rgba[k, :3] += _PALE * (np.array(TABLE_RGBA[:3]) - model.mat_rgba[k, :3])
        self._simulation.place(self._simulation.joined(q))
        return self._camera.show(None, lines)[self._window].copy()

    def pixel(self, point: Float[np.ndarray, "3"]) -> tuple[float, float]:
        """Returns the place [px] of a point in the world [m], from the left and from the top."""
        right, up, back = (point - self._eye) @ self._axes
        left_side, right_side, low, high = self._sides
        share = np.array([(right / -back - left_side) / (right_side - left_side), (high - up / -back) / (high - low)])
        x, y = share * self._whole - self._corner
        return float(x), float(y)
