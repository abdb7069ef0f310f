"""Distances of MuJoCo geoms, and directions that separate them during a whole step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.convex import Convex, separation
from mmp_env.check.distance import MESH, geom_support
from mmp_env.check.fields import rotation
from mmp_env.check.model import CellModel, Poses
from mmp_env.mujoco_import import mujoco

_FAR_M = 100.0
_DOUBT_M = 1e-8
"""Tolerance [m]: we trust MuJoCo's distance only if its direction certifies it within this."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GeomSteps:
    """Pairs of geoms, by id, in steps from pose `start` to pose `end`; `inner` ones are seen from `first`."""

    start: Int[np.ndarray, "g"]
    end: Int[np.ndarray, "g"]
    first: Int[np.ndarray, "g"]
    second: Int[np.ndarray, "g"]
    inner: Bool[np.ndarray, "g"]


class GeomDistance:
    """Measures the clearances of the geoms of one model."""

    def __init__(self, model: CellModel) -> None:
        self._model = model
        self._turns = np.array([rotation(quaternion) for quaternion in model.mujoco.geom_quat]).reshape(-1, 3, 3)

    def measure(
        self, poses: Poses, steps: GeomSteps
    ) -> tuple[Float[np.ndarray, "g"], Float[np.ndarray, "g"], Float[np.ndarray, "g"]]:
        """Returns clearances [m]: during the whole step if all points moved along chords, at the start, and at the end.

        A direction that separates two geoms at both ends separates them in between by the smaller gap.
        """
        ends = [np.stack([at, steps.first, steps.second], axis=1) for at in (steps.start, steps.end)]
        keys, place = np.unique(np.concatenate(ends), axis=0, return_inverse=True)
        distance, direction = (values[place.reshape(2, -1)] for values in self._distances(poses, keys))
        gaps = {
            (seen, end): self._gap(poses, ends[end], self._turned(poses, steps, seen, end, direction[seen]))
            for seen in (0, 1)
            for end in (0, 1)
        }
        lower = np.maximum(np.minimum(gaps[0, 0], gaps[0, 1]), np.minimum(gaps[1, 0], gaps[1, 1]))
        # A gap is a proof of distance, whatever MuJoCo says.
        at_start, at_end = (np.maximum(distance[end], gaps[end, end]) for end in (0, 1))
        return lower, at_start, at_end

    def _distances(
        self, poses: Poses, keys: Int[np.ndarray, "k 3"]
    ) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k 3"]]:
        """Returns signed distances [m] at (pose, geom, geom), and unit directions from the first geom to the second.

        They are MuJoCo's, unless its direction does not certify its distance.
        """
        distance, grown, line = np.empty(len(keys)), np.empty(len(keys)), np.zeros((len(keys), 6))
        placed, data = -1, None
        for k, (pose, first, second) in enumerate(keys.tolist()):
            if pose != placed or data is None:
                placed, data = pose, self._model.place(poses.q[pose])
            distance[k] = mujoco.mj_geomDistance(self._model.mujoco, data, first, second, _FAR_M, line[k])
            # MuJoCo measures meshes that are not grown yet.
            grown[k] = sum(self._model.meshes[geom].radius for geom in (first, second) if geom in self._model.meshes)
        along = (line[:, 3:] - line[:, :3]) * np.sign(distance)[:, None]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        direction = np.divide(along, length, out=np.tile([0.0, 0.0, 1.0], (len(keys), 1)), where=length > 0)
        gap = self._gap(poses, keys, direction)
        doubted = (distance > 0) & ~(distance - grown - gap <= _DOUBT_M)
        distance -= grown
        for k in np.flatnonzero(doubted):
            pose, *pair = keys[k].tolist()
            distance[k], direction[k] = separation(*(self._convex(poses, pose, geom) for geom in pair))
        return distance, direction

    def _turned(
        self, poses: Poses, steps: GeomSteps, seen: int, end: int, direction: Float[np.ndarray, "g 3"]
    ) -> Float[np.ndarray, "g 3"]:
        """Returns directions of one end (0: start, 1: end) at another; inner ones turn with the first geom."""
        if seen == end:
            return direction
        body = self._model.mujoco.geom_bodyid[steps.first]
        there, here = ((steps.start, steps.end)[which] for which in (seen, end))
        inside = np.einsum("kji,kj->ki", poses.rotations[there, body], direction)
        turned = np.einsum("kij,kj->ki", poses.rotations[here, body], inside)
        return np.where(steps.inner[:, None], turned, direction)

    def _gap(
        self, poses: Poses, keys: Int[np.ndarray, "k 3"], direction: Float[np.ndarray, "k 3"]
    ) -> Float[np.ndarray, "k"]:
        """Returns the gap [m] that directions show between geoms at (pose, geom, geom), at most their distance."""
        at, first, second = keys.T
        center, support = self._extent(poses, at, first, direction)
        other, other_support = self._extent(poses, at, second, -direction)
        return -other - center - support - other_support

    def _convex(self, poses: Poses, at: int, geom: int) -> Convex:
        """Returns a geom in the world at a pose."""
        mj = self._model.mujoco
        body = mj.geom_bodyid[geom]
        turn = poses.rotations[at, body]
        return Convex(
            kind=int(mj.geom_type[geom]),
            size=mj.geom_size[geom],
            center=poses.positions[at, body] + turn @ mj.geom_pos[geom],
            rotation=turn @ self._turns[geom],
            mesh=self._model.meshes.get(geom),
        )

    def _extent(
        self, poses: Poses, at: Int[np.ndarray, "g"], geom: Int[np.ndarray, "g"], direction: Float[np.ndarray, "g 3"]
    ) -> tuple[Float[np.ndarray, "g"], Float[np.ndarray, "g"]]:
        """Returns where the centres of geoms lie along directions, and how far the geoms reach from there [m]."""
        mj = self._model.mujoco
        body = mj.geom_bodyid[geom]
        turn = poses.rotations[at, body]
        center = poses.positions[at, body] + np.einsum("kij,kj->ki", turn, mj.geom_pos[geom])
        local = np.einsum("kji,kj->ki", self._turns[geom], np.einsum("kji,kj->ki", turn, direction))
        reach = geom_support(mj.geom_type[geom], mj.geom_size[geom], local)
        for number in np.unique(geom[mj.geom_type[geom] == MESH]).tolist():
            mesh, rows = self._model.meshes[number], geom == number
            reach[rows] = (local[rows] @ mesh.vertices.T).max(axis=1) + mesh.radius
        return np.einsum("ki,ki->k", center, direction), reach
