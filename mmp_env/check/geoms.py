"""The exact check: MuJoCo's own geoms instead of spheres.

`mj_geomDistance` proposes a direction between two geoms, and plain support functions prove with it: if it separates
them by a gap at both ends of a step, then by the smaller gap, less what their points stray from chords, all the way. So
no proof rests on the accuracy of MuJoCo's distances; they only tell how close the geoms come at the instants looked at.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.bounding_spheres import step_minimum
from mmp_env.check.distance import GEOM_KINDS
from mmp_env.check.fields import UnreadableError
from mmp_env.check.geom_distance import GeomSteps, Ruler
from mmp_env.check.items import Bounds, Items, by_pair
from mmp_env.check.model import CellModel, Cloud, Parts, Poses, enclosing_ball, stack_parts
from mmp_env.check.pairs import Pairs, part_pairs
from mmp_env.check.spheres import CloudPairs, CloudSolids, closest, cloud_centers


def geom_parts(model: CellModel) -> tuple[Parts, tuple[Cloud, ...], tuple[np.ndarray, ...]]:
    """One part per link or tool with geoms that collide in MuJoCo, the balls around these geoms, and their ids."""
    mj = model.mujoco
    arms = {arm.name: k for k, arm in enumerate(model.cell.arms)}
    collides = (mj.geom_contype | mj.geom_conaffinity) != 0
    strange = np.flatnonzero(collides & ~np.isin(mj.geom_type, GEOM_KINDS))
    if len(strange):
        raise UnreadableError(f"a geom of '{mj.body(mj.geom_bodyid[strange[0]]).name}' has a shape with no exact check")
    rows, clouds, ids = [], [], []
    for body in range(1, mj.nbody):
        geoms = np.flatnonzero(collides & (mj.geom_bodyid == body))
        if not len(geoms):
            continue
        arm, _, link = mj.body(body).name.partition("/")
        centers, radii = mj.geom_pos[geoms], mj.geom_rbound[geoms]
        center, radius = enclosing_ball(centers, radii)
        reach = model.reaches(body, np.vstack([centers, center]), np.append(radii, 0.0))
        rows.append((link, arms[arm], body, model.moves(body), center, radius, reach))
        clouds.append(Cloud(link=link, centers=centers, radii=radii, center=center, radius=radius))
        ids.append(geoms)
    return stack_parts(rows), tuple(clouds), tuple(ids)


class Nearest:
    """Gathers the bounds of items of parts from those of their geoms: from balls where these reach `target` [m]."""

    def __init__(self, items: Items, stray: Float[np.ndarray, "i"], target: float) -> None:
        self._items, self._stray, self._target = items, stray, target
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
        """Items of one pair of parts, with the distances between the balls of geoms `ids` on their way."""
        balls = balls - self._stray[chosen][:, None, None]
        far = balls >= self._target
        self._lower[chosen] = np.where(far, balls, np.inf).min(axis=(1, 2))
        row, one, other = np.nonzero(~far)
        self._open.append((chosen[row], ids[0][one], ids[1][other], np.full(len(row), inner)))

    def bounds(self, ruler: Ruler, poses: Poses) -> Bounds:
        """What the items come to when the geoms that are left have been measured."""
        item, first, second, inner = (np.concatenate(column) for column in zip(*self._open, strict=True))
        items = self._items
        steps = GeomSteps(start=items.start[item], end=items.end[item], first=first, second=second, inner=inner)
        lower, at_start, at_end = ruler.measure(poses, steps)
        out = np.full((3, len(items)), np.inf)
        out[0] = self._lower
        for row, values in zip(out, (lower - self._stray[item], at_start, at_end), strict=True):
            np.minimum.at(row, item, values)
        return Bounds.of(items, *out)


class GeomPairs(CloudPairs):
    """Geoms of different arms, and of different links of one arm, as far as MuJoCo lets them collide."""

    def __init__(
        self, model: CellModel, parts: Parts, clouds: tuple[Cloud, ...], pairs: Pairs, ids: tuple[np.ndarray, ...]
    ) -> None:
        super().__init__(model, parts, clouds, pairs)
        self._ids, self._ruler = ids, Ruler(model)

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Bounds from the balls around geoms where they reach the target, and else from separating directions."""
        near = Nearest(items, self.strays(items), target)
        for pair, chosen in by_pair(items):
            one, other = int(self._pairs.first[pair]), int(self._pairs.second[pair])
            inner = bool(self._pairs.inner[pair])
            radii = self._clouds[one].radii[:, None] + self._clouds[other].radii
            ends = [self.ends(poses, which[chosen], pair) for which in (items.start, items.end)]
            near.add(chosen, closest(*ends)[0] - radii, (self._ids[one], self._ids[other]), inner=inner)
        return near.bounds(self._ruler, poses)


class GeomSolids(CloudSolids):
    """Geoms of moving links against obstacles."""

    def __init__(self, model: CellModel, parts: Parts, clouds: tuple[Cloud, ...], ids: tuple[np.ndarray, ...]) -> None:
        super().__init__(model, parts, clouds)
        self._ids, self._ruler = ids, Ruler(model)
        self._solid_ids = [np.array([model.mujoco.geom(f"obstacle/{s.name}").id]) for s in model.cell.solids]

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Bounds from the balls around geoms where they reach the target, and else from separating directions."""
        near = Nearest(items, self.strays(items), target)
        for pair, chosen in by_pair(items):
            part, solid = int(self.part[pair]), int(self.solid[pair])
            cloud, body = self._clouds[part], int(self._parts.body[part])
            ends = [cloud_centers(poses, which[chosen], body, cloud) for which in (items.start, items.end)]
            balls = step_minimum(self._solids[solid], *ends)[0] - cloud.radii
            near.add(chosen, balls[:, :, None], (self._ids[part], self._solid_ids[solid]), inner=False)
        return near.bounds(self._ruler, poses)


def colliding_pairs(model: CellModel, parts: Parts) -> Pairs:
    """The pairs of parts that MJCF does not exclude either."""
    pairs = part_pairs(model.cell, parts)
    low, high = np.sort(parts.body[np.stack([pairs.first, pairs.second])], axis=0)
    return pairs[~np.isin((low << 16) + high, model.mujoco.exclude_signature)]
