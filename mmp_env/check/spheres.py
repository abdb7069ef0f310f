"""Sphere clouds against each other and against obstacles, in steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.bounding_spheres import BoundingSpherePairs, BoundingSphereSolids, step_minimum
from mmp_env.check.distance import chord_minimum
from mmp_env.check.items import Bounds, Items, by_value
from mmp_env.check.model import CellModel, LinkSpheres, Poses, RigidParts
from mmp_env.check.pairs import Pairs

_BATCH = 400_000
"""Number of sphere pairs measured at once; bounds the memory of a check."""

_ENOUGH, _ENOUGH_M = 2.0, 0.01
"""Multiple of the target, and length [m] added to it, from which on a lower bound may stand for a distance."""


class SpherePairs(BoundingSpherePairs):
    """Clouds of different arms, and of different links of one arm."""

    def __init__(self, model: CellModel, parts: RigidParts, clouds: tuple[LinkSpheres, ...], pairs: Pairs) -> None:
        super().__init__(model, parts, pairs)
        self._clouds = clouds
        cloud = same_clouds(clouds)
        columns = np.stack([cloud[pairs.first], cloud[pairs.second], pairs.inner.astype(int)], axis=1)
        _, examples, self._kinds = np.unique(columns, axis=0, return_index=True, return_inverse=True)
        self._kind_parts = np.stack([pairs.first[examples], pairs.second[examples]], axis=1)

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Returns bounds from every pair of spheres: the closest approach on chords, less the deviation from them."""
        lower, at_start, at_end = np.empty((3, len(items)))
        for kind, chosen in by_value(self._kinds[items.pair]):
            first, second = (self._clouds[part] for part in self._kind_parts[kind])
            radii = first.radii[:, None] + second.radii
            size = max(_BATCH // radii.size, 1)
            for k in range(0, len(chosen), size):
                some = chosen[k : k + size]
                ends = [self.ends(poses, which[some], items.pair[some]) for which in (items.start, items.end)]
                lengths = closest(ends[0], ends[1])
                lower[some], at_start[some], at_end[some] = ((d - radii).min(axis=(1, 2)) for d in lengths)
        return Bounds.of(items, lower - self.deviations(items), at_start, at_end)

    def ends(
        self, poses: Poses, at: Int[np.ndarray, "m"], pairs: Int[np.ndarray, "m"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the sphere centres [m, s, 3] [m] of both parts of pairs of one kind, in their frame."""
        first, second = self._pairs.first[pairs], self._pairs.second[pairs]
        cloud, other = self._clouds[first[0]], self._clouds[second[0]]
        centers = cloud_centers(poses, at, self._parts.body[second], other)
        body = self._parts.body[first]
        if not self._pairs.inner[pairs[0]]:
            return cloud_centers(poses, at, body, cloud), centers
        inside = (centers - poses.positions[at, body][:, None]) @ poses.rotations[at, body]
        return np.broadcast_to(cloud.centers, (len(at), *cloud.centers.shape)), inside


class SphereSolids(BoundingSphereSolids):
    """Clouds of moving links against obstacles."""

    def __init__(self, model: CellModel, parts: RigidParts, clouds: tuple[LinkSpheres, ...]) -> None:
        super().__init__(model, parts)
        self._clouds = clouds
        self._kinds = same_clouds(clouds)[self.part] * len(model.cell.solids) + self.solid

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Returns bounds from every sphere."""
        lower, at_start, at_end = np.empty((3, len(items)))
        deviations = self.deviations(items)
        target += float(self.growths(poses, items, items.end).max())
        for _, chosen in by_value(self._kinds[items.pair]):
            parts, pair = self.part[items.pair[chosen]], items.pair[chosen[0]]
            cloud, body = self._clouds[parts[0]], self._parts.body[parts]
            ends = [cloud_centers(poses, which[chosen], body, cloud) for which in (items.start, items.end)]
            near = _ENOUGH * target + _ENOUGH_M + cloud.radii.max() + deviations[chosen].max()
            found = step_minimum(self._solids[self.solid[pair]], *ends, near=float(near))
            lower[chosen], at_start[chosen], at_end[chosen] = ((part - cloud.radii).min(axis=1) for part in found)
        return self.after_growth(poses, items, Bounds.of(items, lower - deviations, at_start, at_end))


def same_clouds(clouds: Sequence[LinkSpheres]) -> Int[np.ndarray, "p"]:
    """Returns a number for each cloud, the same for arms that share it."""
    numbers: dict[int, int] = {}
    return np.array([numbers.setdefault(id(cloud), len(numbers)) for cloud in clouds], dtype=int)


def cloud_centers(
    poses: Poses, at: Int[np.ndarray, "m"], body: int | Int[np.ndarray, "m"], cloud: LinkSpheres
) -> Float[np.ndarray, "m s 3"]:
    """Returns the sphere centres [m] of a cloud on a body (one, or one of each) in the world, at some of the poses."""
    return poses.positions[at, body][:, None] + cloud.centers @ poses.rotations[at, body].transpose(0, 2, 1)


def closest(
    start: tuple[np.ndarray, np.ndarray], end: tuple[np.ndarray, np.ndarray]
) -> tuple[Float[np.ndarray, "m a b"], Float[np.ndarray, "m a b"], Float[np.ndarray, "m a b"]]:
    """Returns distances [m] between the centres of two clouds that go straight: the least, at the start, at the end.

    With d the difference of two centres and e its change, d.d, d.e and e.e for all pairs come from matrix products.
    """
    (a, b), (a_step, b_step) = start, (end[0] - start[0], end[1] - start[1])
    b, b_step = b.transpose(0, 2, 1), b_step.transpose(0, 2, 1)
    square = _rows(a, a) + _columns(b, b) - 2.0 * (a @ b)
    dot = _rows(a, a_step) + _columns(b, b_step) - a @ b_step - a_step @ b
    step = _rows(a_step, a_step) + _columns(b_step, b_step) - 2.0 * (a_step @ b_step)
    at_end = np.sqrt(np.maximum(square + 2.0 * dot + step, 0.0))
    at_start = np.sqrt(np.maximum(square, 0.0))
    return chord_minimum(square, dot, step), at_start, at_end


def _rows(a: np.ndarray, b: np.ndarray) -> Float[np.ndarray, "m s 1"]:
    return np.einsum("msi,msi->ms", a, b)[:, :, None]


def _columns(a: np.ndarray, b: np.ndarray) -> Float[np.ndarray, "m 1 s"]:
    return np.einsum("mis,mis->ms", a, b)[:, None, :]
