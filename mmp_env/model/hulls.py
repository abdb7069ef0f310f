"""Exact geometry: convex hulls of links and tools, read from a hulls.json, which may also say where they are from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.model.read_only import ReadOnly

UNKNOWN_PROTRUSION_M = 1e9
"""Protrusion [m] of spheres of which none is known. Then every pair of near spheres asks for a distance of hulls."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Hull(ReadOnly):
    """A convex hull on a link.

    Attributes:
        link: index of the link; 0 in a tool.
        vertices: points [v, 3] [m] in the frame of the link or tool.
        radius: radius [m] of the ball that grows their hull.
    """

    link: int
    vertices: Float[np.ndarray, "v 3"]
    radius: float

    @brief
    def __repr__(self) -> str:
        return f"of {len(self.vertices)} points on link {self.link}, grown by {self.radius * 1e3:.3g} mm"


def read_hulls(data: Mapping[str, Any], links: Sequence[str]) -> tuple[Hull, ...]:
    """Returns the hulls in the content of a hulls.json, in the order of the links."""
    return tuple(
        Hull(link=k, vertices=np.array(piece["vertices"], dtype=float), radius=float(piece["radius"]))
        for k, link in enumerate(links)
        for piece in data.get(link, ())
    )
