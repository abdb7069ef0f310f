"""Geometry of an imported arm (pieces and covers by link), and its kinematics over batches of configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.importing.cover_fit import Cover
from mmp_env.importing.pieces import Piece


@dataclass(frozen=True, kw_only=True, eq=False)
class Kinematics:
    """A serial chain: `origins[k]` is the pose of joint k in link k at q = 0, `axes[k]` its axis there."""

    origins: Float[np.ndarray, "dof 4 4"]
    axes: Float[np.ndarray, "dof 3"]
    slide: Bool[np.ndarray, "dof"]

    def link_poses(self, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "links n 4 4"]:
        """Returns the poses of all links in the base frame."""
        out = [np.tile(np.eye(4), (len(q), 1, 1))]
        for k, (origin, axis) in enumerate(zip(self.origins, self.axes, strict=True)):
            move = np.tile(np.eye(4), (len(q), 1, 1))
            if self.slide[k]:
                move[:, :3, 3] = q[:, k, None] * axis
            else:
                move[:, :3, :3] = _rotations(axis, q[:, k])
            out.append(out[-1] @ origin @ move)
        return np.stack(out)


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmGeometry:
    """Kinematics and geometry by link: convex pieces, and a cover for each sphere set (None: a link of no geometry)."""

    links: tuple[str, ...]
    kinematics: Kinematics
    pieces: tuple[tuple[Piece, ...], ...]
    covers: Mapping[str, Sequence[Cover | None]]
    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]

    def neighbours(self) -> list[tuple[int, int]]:
        """Returns the pairs of links that hang on each other; links of no geometry between do not count."""
        solid = [k for k, own in enumerate(self.pieces) if own]
        return list(pairwise(solid))

    def draw(self, count: int, seed: int) -> Float[np.ndarray, "n dof"]:
        """Returns random configurations within the limits."""
        return np.random.default_rng(seed).uniform(self.lower, self.upper, (count, len(self.lower)))


def _rotations(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angles)[:, None, None] * skew + (1 - np.cos(angles))[:, None, None] * (skew @ skew)
