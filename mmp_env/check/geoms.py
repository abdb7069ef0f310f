"""The exact check: MuJoCo's own geoms instead of spheres.

`mj_geomDistance` proposes a direction between two geoms. Plain support functions prove with it: if the direction
separates the geoms by a gap at both ends of a step, then it separates them during the whole step by the smaller gap,
less the deviation of their points from chords. No proof relies on the accuracy of MuJoCo's distances; they only say how
close the geoms come at the instants looked at.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.bounding_spheres import step_minimum
from mmp_env.check.distance import GEOM_KINDS
from mmp_env.check.fields import UnreadableError
from mmp_env.check.geom_distance import GeomDistance, GeomSteps
from mmp_env.check.items import Bounds, Items, by_value
from mmp_env.check.model import CellModel, LinkSpheres, Poses, RigidParts, enclosing_ball, stack_parts
from mmp_env.check.pairs import Pairs, part_pairs
from mmp_env.check.spheres import SpherePairs, SphereSolids, closest, cloud_centers


def geom_parts(model: CellModel) -> tuple[RigidParts, tuple[LinkSpheres, ...], tuple[np.ndarray, ...]]:
    """Returns a part for each link or tool with colliding geoms, the balls around its geoms, and their ids.

    Raises:
        UnreadableError: if a geom has a shape without an exact check.
    """
    mj = model.mujoco
    arms = {arm.name: k for k, arm in enumerate(model.cell.arms)}
    collides = (mj.geom_contype | mj.geom_conaffinity) != 0
    known = np.isin(mj.geom_type, GEOM_KINDS) | np.isin(np.arange(mj.ngeom), list(model.meshes))
    strange = np.flatnonzero(collides & ~known)
    if len(strange):
        raise UnreadableError(f"a geom of '{mj.body(mj.geom_bodyid[strange[0]]).name}' has a shape with no exact check")
    rows, clouds, ids = [], [], []
    for body in range(1, mj.nbody):
        geoms = np.flatnonzero(collides & (mj.geom_bodyid == body))
        if not len(geoms):
            continue
        arm, _, link = mj.body(body).name.partition("/")
        centers, radii = mj.geom_pos[geoms], mj.geom_rbound[geoms].copy()
        for k, geom in enumerate(geoms.tolist()):
            if geom in model.meshes:  # MuJoCo's bound is rounded, and of a mesh that is not grown
                mesh = model.meshes[geom]
                radii[k] = np.linalg.norm(mesh.vertices, axis=1).max() + mesh.radius
        center, radius = enclosing_ball(centers, radii)
        reach = model.reaches(body, np.vstack([centers, center]), np.append(radii, 0.0))
        rows.append((link, arms[arm], body, model.moves(body), center, radius, reach))
        clouds.append(LinkSpheres(link=link, centers=centers, radii=radii, center=center, radius=radius))
        ids.append(geoms)
    return stack_parts(rows), tuple(clouds), tuple(ids)


class GeomBounds:
    """Collects bounds of pairs of parts from their geoms; balls around geoms suffice if they reach `target` [m]."""

    def __init__(self, items: Items, deviation: Float[np.ndarray, "i"], target: float) -> None:
        self._items, self._deviation, self._target = items, deviation, target
        self._lower = np.full(len(items), np.inf)
        self._open: list[tuple[np.ndarray, ...]] = []

    def add(
        self,
        chosen: Int[np.ndarray, "k"],
        balls: Float[np.ndarray, "k a b"],
        ids: tuple[np.ndarray, np.ndarray],
        *,
        inner: bool,
    ) -> None:
        """Adds items of one pair of parts.

        Args:
            chosen: the items.
            balls: least distances [m] between the balls of the geoms during the step.
            ids: ids of the geoms of both parts.
            inner: whether both parts belong to one arm.
        """
        balls = balls - self._deviation[chosen][:, None, None]
        far = balls >= self._target
        self._lower[chosen] = np.where(far, balls, np.inf).min(axis=(1, 2))
        row, one, other = np.nonzero(~far)
        self._open.append((chosen[row], ids[0][one], ids[1][other], np.full(len(row), inner)))

    def bounds(self, distance: GeomDistance, poses: Poses) -> Bounds:
        """Measures the geoms whose balls did not suffice, and returns the bounds of all items."""
        item, first, second, inner = (np.concatenate(column) for column in zip(*self._open, strict=True))
        items = self._items
        steps = GeomSteps(start=items.start[item], end=items.end[item], first=first, second=second, inner=inner)
        lower, at_start, at_end = distance.measure(poses, steps)
        out = np.full((3, len(items)), np.inf)
        out[0] = self._lower
        for row, values in zip(out, (lower - self._deviation[item], at_start, at_end), strict=True):
            np.minimum.at(row, item, values)
        return Bounds.of(items, *out)


class GeomPairs(SpherePairs):
    """Geoms of different arms, and of different links of one arm, if MuJoCo lets them collide."""

    def __init__(
        self,
        model: CellModel,
        parts: RigidParts,
        clouds: tuple[LinkSpheres, ...],
        pairs: Pairs,
        ids: tuple[np.ndarray, ...],
    ) -> None:
        super().__init__(model, parts, clouds, pairs)
        self._ids, self._distance = ids, GeomDistance(model)

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Returns bounds from balls around geoms where they reach the target, otherwise from separating directions."""
        near = GeomBounds(items, self.deviations(items), target)
        for pair, chosen in by_value(items.pair):
            one, other = int(self._pairs.first[pair]), int(self._pairs.second[pair])
            inner = bool(self._pairs.inner[pair])
            radii = self._clouds[one].radii[:, None] + self._clouds[other].radii
            ends = [self.ends(poses, which[chosen], items.pair[chosen]) for which in (items.start, items.end)]
            near.add(chosen, closest(*ends)[0] - radii, (self._ids[one], self._ids[other]), inner=inner)
        return near.bounds(self._distance, poses)


class GeomSolids(SphereSolids):
    """Geoms of moving links against obstacles."""

    def __init__(
        self, model: CellModel, parts: RigidParts, clouds: tuple[LinkSpheres, ...], ids: tuple[np.ndarray, ...]
    ) -> None:
        super().__init__(model, parts, clouds)
        self._ids, self._distance = ids, GeomDistance(model)
        self._solid_ids = [np.array([model.mujoco.geom(s.geom).id]) for s in model.cell.solids]

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Returns bounds from balls around geoms where they reach the target, otherwise from separating directions."""
        target += float(self.growths(poses, items, items.end).max())
        near = GeomBounds(items, self.deviations(items), target)
        for pair, chosen in by_value(items.pair):
            part, solid = int(self.part[pair]), int(self.solid[pair])
            cloud, body = self._clouds[part], int(self._parts.body[part])
            ends = [cloud_centers(poses, which[chosen], body, cloud) for which in (items.start, items.end)]
            balls = step_minimum(self._solids[solid], *ends)[0] - cloud.radii
            near.add(chosen, balls[:, :, None], (self._ids[part], self._solid_ids[solid]), inner=False)
        return self.after_growth(poses, items, near.bounds(self._distance, poses))


def colliding_pairs(model: CellModel, parts: RigidParts) -> Pairs:
    """Returns the pairs of parts that the MJCF does not exclude."""
    pairs = part_pairs(model.cell, parts)
    low, high = np.sort(parts.body[np.stack([pairs.first, pairs.second])], axis=0)
    return pairs[~np.isin((low << 16) + high, model.mujoco.exclude_signature)]
