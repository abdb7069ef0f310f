"""Pairs of MuJoCo geoms over steps: directions that keep them apart all the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.distance import geom_support
from mmp_env.check.fields import rotation
from mmp_env.check.model import CellModel, Poses
from mmp_env.mujoco_import import mujoco

_FAR_M = 100.0


@dataclass(frozen=True, kw_only=True, eq=False)
class GeomSteps:
    """Pairs of geoms, by id, in steps from pose `start` to pose `end`; `inner` pairs move as seen from `first`."""

    start: Int[np.ndarray, "g"]
    end: Int[np.ndarray, "g"]
    first: Int[np.ndarray, "g"]
    second: Int[np.ndarray, "g"]
    inner: Bool[np.ndarray, "g"]


class Ruler:
    """Measures geoms of one model."""

    def __init__(self, model: CellModel) -> None:
        self._model = model
        self._turns = np.array([rotation(quaternion) for quaternion in model.mujoco.geom_quat]).reshape(-1, 3, 3)

    def measure(
        self, poses: Poses, steps: GeomSteps
    ) -> tuple[Float[np.ndarray, "g"], Float[np.ndarray, "g"], Float[np.ndarray, "g"]]:
        """Clearances [m] on the whole way, were all points to move along chords, at the start and at the end.

        A direction that keeps two geoms apart by some gap at both ends keeps them apart by the smaller one between.
        """
        at = np.concatenate([steps.start, steps.end])
        keys = np.stack([at, np.tile(steps.first, 2), np.tile(steps.second, 2)], axis=1)
        keys, place = np.unique(keys, axis=0, return_inverse=True)
        distance, direction = self._distances(poses, keys)
        place = place.reshape(2, -1)
        gaps = {
            (seen, end): self._gap(poses, steps, pose, other, direction[place[seen]])
            for seen, pose in enumerate((steps.start, steps.end))
            for end, other in enumerate((steps.start, steps.end))
        }
        lower = np.maximum(np.minimum(gaps[0, 0], gaps[0, 1]), np.minimum(gaps[1, 0], gaps[1, 1]))
        # A gap is a proof of distance, whatever MuJoCo says.
        at_start, at_end = (np.maximum(distance[place[end]], gaps[end, end]) for end in (0, 1))
        return lower, at_start, at_end

    def _distances(
        self, poses: Poses, keys: Int[np.ndarray, "k 3"]
    ) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k 3"]]:
        """MuJoCo's distances at (pose, geom, geom), and unit directions from the first geom to the second."""
        distance, line = np.empty(len(keys)), np.zeros((len(keys), 6))
        placed, data = -1, None
        for k, (pose, first, second) in enumerate(keys.tolist()):
            if pose != placed or data is None:
                placed, data = pose, self._model.place(poses.q[pose])
            distance[k] = mujoco.mj_geomDistance(self._model.mujoco, data, first, second, _FAR_M, line[k])
        along = (line[:, 3:] - line[:, :3]) * np.sign(distance)[:, None]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        return distance, np.divide(along, length, out=np.tile([0.0, 0.0, 1.0], (len(keys), 1)), where=length > 0)

    def _gap(
        self,
        poses: Poses,
        steps: GeomSteps,
        seen: Int[np.ndarray, "g"],
        at: Int[np.ndarray, "g"],
        direction: Float[np.ndarray, "g 3"],
    ) -> Float[np.ndarray, "g"]:
        """How far a direction separates pairs of geoms at pose `at` [m]: never more than their distance.

        It is given at pose `seen`, and turns with the first geom of an inner pair.
        """
        body = self._model.mujoco.geom_bodyid[steps.first]
        inside = np.einsum("kji,kj->ki", poses.rotations[seen, body], direction)
        turned = np.einsum("kij,kj->ki", poses.rotations[at, body], inside)
        direction = np.where(steps.inner[:, None], turned, direction)
        center, support = self._extent(poses, at, steps.first, direction)
        other, other_support = self._extent(poses, at, steps.second, direction)
        return other - center - support - other_support

    def _extent(
        self, poses: Poses, at: Int[np.ndarray, "g"], geom: Int[np.ndarray, "g"], direction: Float[np.ndarray, "g 3"]
    ) -> tuple[Float[np.ndarray, "g"], Float[np.ndarray, "g"]]:
        """Of geoms along directions: where the centre lies, and how far the geom reaches from it [m]."""
        mj = self._model.mujoco
        body = mj.geom_bodyid[geom]
        turn = poses.rotations[at, body]
        center = poses.positions[at, body] + np.einsum("kij,kj->ki", turn, mj.geom_pos[geom])
        local = np.einsum("kji,kj->ki", self._turns[geom], np.einsum("kji,kj->ki", turn, direction))
        reach = geom_support(mj.geom_type[geom], mj.geom_size[geom], local)
        return np.einsum("ki,ki->k", center, direction), reach
