"""The covering spheres of held objects, computed independently by the rule of docs/reference/files.md."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedArm, Solid
from mmp_env.check.fields import rotation

BODY = "held"
_CELL_M, _GROWTH, _MOST = 0.02, 1.25, 64


def held_spheres(solid: Solid) -> Float[np.ndarray, "s 4"]:
    """Returns x, y, z and radius [m] of spheres that cover a solid, in the frame of its pose."""
    radius, half = solid.size[0], solid.size[1]
    if solid.shape == "box":
        rows = _grid(solid.size)
    elif solid.shape == "sphere":
        rows = [(0.0, 0.0, 0.0, radius)]
    elif solid.shape == "capsule":
        gaps = min(int(np.ceil(2 * half / radius)), _MOST - 1)
        wide = float(np.sqrt(radius**2 + (half / gaps) ** 2))
        rows = [(0.0, 0.0, half * (2 * k / gaps - 1), wide) for k in range(gaps + 1)]
    else:
        slices = min(int(np.ceil(half / radius)), _MOST)
        wide = float(np.sqrt(radius**2 + (half / slices) ** 2))
        rows = [(0.0, 0.0, half * ((2 * k + 1) / slices - 1), wide) for k in range(slices)]
    table = np.array(rows)
    table[:, :3] = table[:, :3] @ rotation(solid.quaternion).T + solid.position
    return table


def holders(arm: CheckedArm) -> list[str]:
    """Returns the names of the last link and the tool, which touch the held object."""
    return [arm.robot.data["links"][-1], *([arm.tool.name] if arm.tool else [])]


def _grid(half: Float[np.ndarray, "3"]) -> list[tuple[float, float, float, float]]:
    edge = _CELL_M
    while (cells := np.ceil(2 * half / edge)).prod() > _MOST:
        edge *= _GROWTH
    counts = [int(n) for n in cells]
    reach = float(np.sqrt(((half / cells) ** 2).sum()))
    return [
        (
            half[0] * ((2 * i + 1) / counts[0] - 1),
            half[1] * ((2 * j + 1) / counts[1] - 1),
            half[2] * ((2 * k + 1) / counts[2] - 1),
            reach,
        )
        for i in range(counts[0])
        for j in range(counts[1])
        for k in range(counts[2])
    ]
