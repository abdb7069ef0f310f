"""The broad phase: one bounding sphere for each part."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import Solid
from mmp_env.check.distance import chord_minimum, solid_distance, tangent_minimum
from mmp_env.check.fields import rotation
from mmp_env.check.items import Items, MotionSteps, Touch
from mmp_env.check.model import CellModel, Poses, RigidParts
from mmp_env.check.pairs import ChordDeviation, Pairs
from mmp_env.check.polyhedron import polyhedron


class BoundingSpherePairs:
    """Bounding spheres of parts against each other: of different arms, or of one arm."""

    def __init__(self, model: CellModel, parts: RigidParts, pairs: Pairs) -> None:
        self._model, self._parts, self._pairs = model, parts, pairs
        self.rule = "self" if pairs.inner.any() else "arm-arm"
        first, second, inner = pairs.first, pairs.second, pairs.inner[:, None]
        reach = parts.reach[second] + np.where(inner, 0.0, parts.reach[first])
        common = parts.moves[first] & inner
        self._deviation = ChordDeviation(model, reach, common)
        self._part_deviation = ChordDeviation(model, parts.reach)
        self._inner_deviation = ChordDeviation(model, reach[pairs.inner], common[pairs.inner])
        self._radii = parts.radius[first] + parts.radius[second]

    def __len__(self) -> int:
        return len(self._pairs)

    def coarse(self, poses: Poses, steps: MotionSteps) -> Float[np.ndarray, "u p"]:
        """Returns lower bounds on the clearance [m] of all pairs in the steps between consecutive poses."""
        parts, first, second, inner = self._parts, self._pairs.first, self._pairs.second, self._pairs.inner
        balls = ball_centers(parts, poses)
        body = parts.body[first[inner]]
        center = balls[:, second[inner]] - poses.positions[:, body]
        seen = np.einsum("mpji,mpj->mpi", poses.rotations[:, body], center) - parts.center[first[inner]]
        square, dot, length = np.zeros((3, len(balls) - 1, len(first)))
        for axis in range(3):  # arrays of one coordinate each are several times faster than of all three
            apart = balls[:, second, axis] - balls[:, first, axis]
            apart[:, inner] = seen[:, :, axis]
            start, step = apart[:-1], apart[1:] - apart[:-1]
            square += start * start
            dot += start * step
            length += step * step
        least = chord_minimum(square, dot, length)
        deviation = self._part_deviation.all(steps)
        deviation = deviation[:, first] + deviation[:, second]
        deviation[:, inner] = self._inner_deviation.all(steps)
        return least - self._radii - deviation

    def deviations(self, items: Items) -> Float[np.ndarray, "i"]:
        """Returns a bound on how far the points of each item deviate from chords [m]."""
        return self._deviation.each(items.steps, items.step, items.pair)

    def names(self, pair: int) -> Touch:
        """Returns the names of a pair."""
        (arm, one), (other_arm, other) = (
            (self._model.cell.arms[self._parts.arm[k]].name, self._parts.links[k])
            for k in (self._pairs.first[pair], self._pairs.second[pair])
        )
        things = (f"{arm}/{one}", f"{other_arm}/{other}")
        return Touch(rule=self.rule, arms=(arm,) if self.rule == "self" else (arm, other_arm), things=things)


class BoundingSphereSolids:
    """Bounding spheres of moving parts against obstacles: pairs of `part` [p] and `solid` [p], by index."""

    rule = "arm-obstacle"

    def __init__(self, model: CellModel, parts: RigidParts) -> None:
        moving = np.flatnonzero(parts.moves.any(axis=1))
        solids = model.cell.solids
        self._model, self._parts, self._moving, self._solids = model, parts, moving, solids
        self.part = np.tile(moving, len(solids))
        self.solid = np.repeat(np.arange(len(solids)), len(moving))
        self._deviation = ChordDeviation(model, parts.reach)
        self._allowed = [k for k in range(len(self.part)) if self.names(k).things[0] in solids[self.solid[k]].may_touch]

    def __len__(self) -> int:
        return len(self.part)

    def coarse(self, poses: Poses, steps: MotionSteps) -> Float[np.ndarray, "u p"]:
        """Returns lower bounds on the clearance [m] of all pairs in the steps between consecutive poses.

        They are infinite for pairs that may touch.
        """
        balls = ball_centers(self._parts, poses)[:, self._moving]
        least = np.empty((len(balls) - 1, len(self._solids), len(self._moving)))
        for k, solid in enumerate(self._solids):
            least[:, k] = step_minimum(solid, balls[:-1], balls[1:])[0]
        deviation = self._deviation.all(steps)
        out = least.reshape(len(least), -1) - (self._parts.radius + deviation)[:, self.part]
        out[:, self._allowed] = np.inf
        return out

    def deviations(self, items: Items) -> Float[np.ndarray, "i"]:
        """Returns a bound on how far the points of each item deviate from chords [m]."""
        return self._deviation.each(items.steps, items.step, self.part[items.pair])

    def names(self, pair: int) -> Touch:
        """Returns the names of a pair."""
        part = self.part[pair]
        arm = self._model.cell.arms[self._parts.arm[part]].name
        things = (f"{arm}/{self._parts.links[part]}", f"obstacle/{self._solids[self.solid[pair]].name}")
        return Touch(rule=self.rule, arms=(arm,), things=things)


def ball_centers(parts: RigidParts, poses: Poses) -> Float[np.ndarray, "m p 3"]:
    """Returns the centres of all parts' bounding spheres in the world [m]."""
    return poses.positions[:, parts.body] + np.einsum("mpij,pj->mpi", poses.rotations[:, parts.body], parts.center)


def step_minimum(
    solid: Solid, start: Float[np.ndarray, "*n 3"], end: Float[np.ndarray, "*n 3"], *, near: float = 0.0
) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """Returns signed distances [m] of points on chords to a solid: a lower bound on the chord, those at both ends.

    The distances of points farther than `near` [m] from a piece of a mesh are lower bounds, too.
    """
    turn = rotation(solid.quaternion)
    start, end = (start - solid.position) @ turn, (end - solid.position) @ turn
    if solid.vertices is None:
        first, slope = solid_distance(solid.shape, solid.size, start)
        last, slope_back = solid_distance(solid.shape, solid.size, end)
    else:
        first, slope = polyhedron(solid).distance(start, near)
        last, slope_back = polyhedron(solid).distance(end, near)
    step = end - start
    return tangent_minimum(first, _dot(slope, step), last, -_dot(slope_back, step)), first, last


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)
