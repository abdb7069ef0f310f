"""The exact check: MuJoCo's own geoms instead of spheres.

`mj_geomDistance` proposes a direction between two geoms, and plain support functions prove with it: if it separates
them by a gap at both ends of a step, then by the smaller gap, less what their points stray from chords, all the way. So
no proof rests on the accuracy of MuJoCo's distances; they only tell how close the geoms come at the instants looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.balls import BallPairs, BallSolids
from mmp_env.check.distance import geom_support
from mmp_env.check.items import Bounds, Items
from mmp_env.check.model import CellModel, Parts, Poses, stack_parts
from mmp_env.check.pairs import Pairs, part_pairs
from mmp_env.mujoco_import import mujoco

_FAR_M = 100.0


def geom_parts(model: CellModel) -> tuple[Parts, Int[np.ndarray, "p"]]:
    """One part per geom of an arm or tool that takes part in MuJoCo's collisions, and its geom id."""
    mj = model.mujoco
    names = {f"{arm.name}/": k for k, arm in enumerate(model.cell.arms)}
    rows, ids = [], []
    for geom in np.flatnonzero((mj.geom_contype | mj.geom_conaffinity) & (mj.geom_bodyid > 0)):
        body = int(mj.geom_bodyid[geom])
        prefix, _, link = mj.body(body).name.partition("/")
        center, radius = mj.geom_pos[geom], float(mj.geom_rbound[geom])
        reach = model.reaches(body, center[None], np.array([radius]))
        rows.append((link, names[f"{prefix}/"], body, model.moves(body), center, radius, reach))
        ids.append(geom)
    return stack_parts(rows), np.array(ids)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ruler:
    """Measures pairs of geoms: ids `first` [p] and `second` [p]; `inner` pairs move as seen from `first`."""

    model: CellModel
    first: Int[np.ndarray, "p"]
    second: Int[np.ndarray, "p"]
    inner: Bool[np.ndarray, "p"]

    def bounds(self, poses: Poses, items: Items, stray: Float[np.ndarray, "i"]) -> Bounds:
        """Bounds of items whose points stray from chords by `stray` [m]."""
        keys = np.stack([np.concatenate([items.start, items.end]), np.tile(items.pair, 2)], axis=1)
        keys, place = np.unique(keys, axis=0, return_inverse=True)
        distance, direction = self._distances(poses, keys)
        gap = self._gap(poses, keys[:, 0], keys[:, 0], keys[:, 1], direction)
        # A gap is a proof of distance, whatever MuJoCo says.
        at_start, at_end = np.maximum(distance, gap)[place.reshape(2, -1)]
        lower = np.full(len(items), -np.inf)
        for at, key in zip((items.start, items.end), place.reshape(2, -1), strict=True):
            ends = [self._gap(poses, at, end, items.pair, direction[key]) for end in (items.start, items.end)]
            lower = np.maximum(lower, np.minimum(*ends))
        return Bounds.of(items, lower - stray, at_start, at_end)

    def _distances(
        self, poses: Poses, keys: Int[np.ndarray, "k 2"]
    ) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k 3"]]:
        """MuJoCo's distances at (pose, pair), sorted by pose, and unit directions from the first geom to the second."""
        distance, line = np.empty(len(keys)), np.zeros((len(keys), 6))
        placed, data = -1, None
        for k, (pose, pair) in enumerate(keys.tolist()):
            if pose != placed or data is None:
                placed, data = pose, self.model.place(poses.q[pose])
            ids = self.first[pair], self.second[pair]
            distance[k] = mujoco.mj_geomDistance(self.model.mujoco, data, *ids, _FAR_M, line[k])
        along = (line[:, 3:] - line[:, :3]) * np.sign(distance)[:, None]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        return distance, np.divide(along, length, out=np.tile([0.0, 0.0, 1.0], (len(keys), 1)), where=length > 0)

    def _gap(
        self,
        poses: Poses,
        seen: Int[np.ndarray, "k"],
        at: Int[np.ndarray, "k"],
        pair: Int[np.ndarray, "k"],
        direction: Float[np.ndarray, "k 3"],
    ) -> Float[np.ndarray, "k"]:
        """How far a direction separates pairs of geoms at pose `at` [m]: never more than their distance.

        It is given at pose `seen`, and turns with the first geom of an inner pair.
        """
        inner, body = self.inner[pair], self.model.mujoco.geom_bodyid[self.first[pair]]
        with_body = np.einsum(
            "kij,klj,kl->ki", poses.rotations[at, body], poses.rotations[seen, body], direction, optimize=True
        )
        direction = np.where(inner[:, None], with_body, direction)
        ends = [self._extent(poses, at, geom[pair], direction) for geom in (self.first, self.second)]
        (center, support), (other, other_support) = ends
        return other - center - support - other_support

    def _extent(
        self, poses: Poses, at: Int[np.ndarray, "k"], geom: Int[np.ndarray, "k"], direction: Float[np.ndarray, "k 3"]
    ) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"]]:
        """Of geoms along directions: where the centre lies, and how far the geom reaches from it [m]."""
        mj = self.model.mujoco
        turn, body = poses.rotations[at, mj.geom_bodyid[geom]], mj.geom_bodyid[geom]
        center = poses.positions[at, body] + np.einsum("kij,kj->ki", turn, mj.geom_pos[geom])
        inside = np.einsum("kji,kj->ki", turn, direction)
        local = np.einsum("kji,kj->ki", self._turns[geom], inside)
        reach = geom_support(mj.geom_type[geom], mj.geom_size[geom], local)
        return np.einsum("ki,ki->k", center, direction), reach

    @property
    def _turns(self) -> Float[np.ndarray, "g 3 3"]:
        w, x, y, z = self.model.mujoco.geom_quat.T
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(rows), -1, 0)


class GeomPairs(BallPairs):
    """Geoms of different arms, and of different links of one arm unless either data or MJCF let them overlap."""

    def __init__(self, model: CellModel, parts: Parts, ids: Int[np.ndarray, "p"]) -> None:
        super().__init__(model, parts, _colliding(model, parts, part_pairs(model.cell, parts)))
        pairs = self._pairs
        self._ruler = Ruler(model=model, first=ids[pairs.first], second=ids[pairs.second], inner=pairs.inner)

    def narrow(self, poses: Poses, items: Items) -> Bounds:
        """Bounds from separating directions."""
        return self._ruler.bounds(poses, items, self.strays(poses, items))


class GeomSolids(BallSolids):
    """Geoms of moving links against obstacles."""

    def __init__(self, model: CellModel, parts: Parts, ids: Int[np.ndarray, "p"]) -> None:
        super().__init__(model, parts)
        solids = np.array([model.mujoco.geom(f"obstacle/{solid.name}").id for solid in model.cell.solids], dtype=int)
        inner = np.zeros(len(self.part), dtype=bool)
        self._ruler = Ruler(model=model, first=ids[self.part], second=solids[self.solid], inner=inner)

    def narrow(self, poses: Poses, items: Items) -> Bounds:
        """Bounds from separating directions."""
        return self._ruler.bounds(poses, items, self.strays(poses, items))


def _colliding(model: CellModel, parts: Parts, pairs: Pairs) -> Pairs:
    """The pairs that MJCF does not exclude."""
    low, high = np.sort(parts.body[np.stack([pairs.first, pairs.second])], axis=0)
    keep = ~np.isin((low << 16) + high, model.mujoco.exclude_signature)
    return Pairs(first=pairs.first[keep], second=pairs.second[keep], inner=pairs.inner[keep])
