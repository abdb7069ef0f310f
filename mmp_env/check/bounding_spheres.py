"""The broad phase: one bounding sphere for each part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.boxes import box_gaps, near_boxes, ranges
from mmp_env.check.checked import Solid
from mmp_env.check.distance import chord_minimum, solid_distance, tangent_minimum
from mmp_env.check.fields import rotation
from mmp_env.check.items import Bounds, Items, MotionSteps, Touch
from mmp_env.check.model import CellModel, Poses, RigidParts
from mmp_env.check.pairs import ChordDeviation, Pairs
from mmp_env.check.polyhedron import polyhedron

_BATCH = 400_000
"""Pairs times steps that are measured at once; bounds the memory of a check."""


class BoundingSpherePairs:
    """Bounding spheres of parts against each other: of different arms, or of one arm."""

    def __init__(self, model: CellModel, parts: RigidParts, pairs: Pairs) -> None:
        self._model, self._parts, self._pairs = model, parts, pairs
        self.rule = "self" if pairs.inner.any() else "arm-arm"
        self._deviation = ChordDeviation(model, parts.arm, parts.reach)
        first, second = pairs.first[pairs.inner], pairs.second[pairs.inner]
        self._inner_deviation = ChordDeviation(model, parts.arm[second], parts.reach[second], parts.moves[first])
        self._inner_row = np.cumsum(pairs.inner) - 1
        self._inner = np.flatnonzero(pairs.inner)
        # The pairs of different arms, sorted by their two arms.
        outer = np.flatnonzero(~pairs.inner)
        arms = self._arms_key(parts.arm[pairs.first[outer]], parts.arm[pairs.second[outer]])
        order = np.argsort(arms, kind="stable")
        self._outer, self._outer_arms = outer[order], arms[order]

    def __len__(self) -> int:
        return len(self._pairs)

    def coarse(self, poses: Poses, steps: MotionSteps, cutoff: float) -> tuple[Items, Float[np.ndarray, "i"]]:
        """Returns the items that may be closer than `cutoff` [m] in the steps between consecutive poses.

        Returns:
            The items, step after step, and lower bounds on their clearances [m]. All others are at least `cutoff`.
        """
        balls, deviation = ball_centers(self._parts, poses), self._deviation.all(steps)
        near = self._near(balls, deviation, cutoff)
        size = max(_BATCH // max(len(deviation), 1), 1)
        found = []
        for k in range(0, len(near), size):
            lower = self._lower(poses, balls, deviation, steps, near[k : k + size])
            found.append(closer_items(lower, near[k : k + size], cutoff))
        return joined_items(steps, found)

    def _near(
        self, balls: Float[np.ndarray, "m p 3"], deviation: Float[np.ndarray, "u p"], cutoff: float
    ) -> Int[np.ndarray, "k"]:
        """Returns the pairs whose boxes around all steps are closer than a cutoff [m], and all inner ones."""
        if not len(self._outer):
            return self._inner
        grown = (self._parts.radius + deviation.max(axis=0))[:, None]
        low, high = balls.min(axis=0) - grown, balls.max(axis=0) + grown
        arms = (len(self._model.cell.arms), 3)
        arm_low, arm_high = np.full(arms, np.inf), np.full(arms, -np.inf)
        np.minimum.at(arm_low, self._parts.arm, low)
        np.maximum.at(arm_high, self._parts.arm, high)
        keys = np.sort(self._arms_key(*near_boxes(arm_low, arm_high, cutoff)))
        begin, end = (np.searchsorted(self._outer_arms, keys, side=side) for side in ("left", "right"))
        outer = self._outer[ranges(begin, end)]
        far = box_gaps(low, high, self._pairs.first[outer], self._pairs.second[outer]) >= cutoff
        return np.sort(np.concatenate([self._inner, outer[~far]]))

    def _arms_key(self, one: Int[np.ndarray, "k"], other: Int[np.ndarray, "k"]) -> Int[np.ndarray, "k"]:
        """Returns a number for each two arms, whichever comes first."""
        return np.minimum(one, other) * len(self._model.cell.arms) + np.maximum(one, other)

    def _lower(
        self,
        poses: Poses,
        balls: Float[np.ndarray, "m p 3"],
        part_deviation: Float[np.ndarray, "u p"],
        steps: MotionSteps,
        chosen: Int[np.ndarray, "c"],
    ) -> Float[np.ndarray, "u c"]:
        """Returns lower bounds on the clearance [m] of some pairs in all steps."""
        parts, first, second = self._parts, self._pairs.first[chosen], self._pairs.second[chosen]
        inner = self._pairs.inner[chosen]
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
        deviation = part_deviation[:, first] + part_deviation[:, second]
        if inner.any():
            deviation[:, inner] = self._inner_deviation.all(steps)[:, self._inner_row[chosen[inner]]]
        return chord_minimum(square, dot, length) - (parts.radius[first] + parts.radius[second]) - deviation

    def deviations(self, items: Items) -> Float[np.ndarray, "i"]:
        """Returns a bound on how far the points of each item, those of both parts together, deviate from chords [m]."""
        out = np.empty(len(items))
        inner = self._pairs.inner[items.pair]
        within, between = items[inner], items[~inner]
        out[inner] = self._inner_deviation.each(items.steps, within.step, self._inner_row[within.pair])
        out[~inner] = sum(
            self._deviation.each(items.steps, between.step, part[between.pair])
            for part in (self._pairs.first, self._pairs.second)
        )
        return out

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
        self._deviation = ChordDeviation(model, parts.arm, parts.reach)
        self._speed = np.array([solid.speed for solid in solids])[self.solid]
        self._joints = model.cell.columns
        self._allowed = [k for k in range(len(self.part)) if self.names(k).things[0] in solids[self.solid[k]].may_touch]

    def __len__(self) -> int:
        return len(self.part)

    def coarse(self, poses: Poses, steps: MotionSteps, cutoff: float) -> tuple[Items, Float[np.ndarray, "i"]]:
        """Returns the items that may be closer than `cutoff` [m] in the steps between consecutive poses.

        Returns:
            The items, step after step, and lower bounds on their clearances [m]. All others are at least `cutoff`, or
            may touch.
        """
        balls = ball_centers(self._parts, poses)[:, self._moving]
        least = np.empty((len(balls) - 1, len(self._solids), len(self._moving)))
        for k, solid in enumerate(self._solids):
            least[:, k] = step_minimum(solid, balls[:-1], balls[1:])[0]
        deviation = self._deviation.all(steps)
        out = least.reshape(len(least), -1) - (self._parts.radius + deviation)[:, self.part]
        if self._speed.any():
            out -= self._speed * poses.times[1:, None] * self._arms_of(moving(steps))[:, self._parts.arm[self.part]]
        out[:, self._allowed] = np.inf
        return joined_items(steps, [closer_items(out, np.arange(len(self.part)), cutoff)])

    def growths(self, poses: Poses, items: Items, at: Int[np.ndarray, "i"]) -> Float[np.ndarray, "i"]:
        """Returns how far the solid of each item may have moved [m] at poses; 0 where the arm stands in the step."""
        return self._speed[items.pair] * poses.times[at] * self._arm_moves(items, moving(items.steps))

    def after_growth(self, poses: Poses, items: Items, bounds: Bounds) -> Bounds:
        """Returns bounds to the places of solids as bounds to the solids, which may have moved.

        A clearance is only found where the arm moves. It does so during a whole step in which it goes straight.
        """
        if not self._speed.any():
            return bounds
        straight = ~self._arm_moves(items, items.steps.bend != 0)
        return Bounds(
            lower=bounds.lower - self.growths(poses, items, items.end),
            found=bounds.found - self.growths(poses, items, bounds.at) * straight,
            at=bounds.at,
        )

    def _arm_moves(self, items: Items, moves: Bool[np.ndarray, "u n"]) -> Bool[np.ndarray, "i"]:
        """Returns which items are of arms with joints that move in the step; `moves`: which joints do."""
        return self._arms_of(moves)[items.step, self._parts.arm[self.part[items.pair]]]

    def _arms_of(self, moves: Bool[np.ndarray, "u n"]) -> Bool[np.ndarray, "u a"]:
        """Returns which arms have joints that move in each step."""
        return np.stack([moves[:, joints].any(axis=1) for joints in self._joints], axis=1)

    def deviations(self, items: Items) -> Float[np.ndarray, "i"]:
        """Returns a bound on how far the points of each item deviate from chords [m]."""
        return self._deviation.each(items.steps, items.step, self.part[items.pair])

    def names(self, pair: int) -> Touch:
        """Returns the names of a pair."""
        part = self.part[pair]
        arm = self._model.cell.arms[self._parts.arm[part]].name
        things = (f"{arm}/{self._parts.links[part]}", f"obstacle/{self._solids[self.solid[pair]].name}")
        return Touch(rule=self.rule, arms=(arm,), things=things)


def moving(steps: MotionSteps) -> Bool[np.ndarray, "u n"]:
    """Returns which joints move in each step."""
    return (steps.move != 0) | (steps.bend != 0)


def closer_items(
    lower: Float[np.ndarray, "u c"], pairs: Int[np.ndarray, "c"], cutoff: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns step, pair and lower bound [m] where bounds of some pairs in all steps are below a cutoff, or NaN."""
    step, place = np.nonzero(~(lower >= cutoff))
    return step, pairs[place], lower[step, place]


def joined_items(
    steps: MotionSteps, found: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> tuple[Items, Float[np.ndarray, "i"]]:
    """Returns items and bounds, step after step, from columns of step, pair and bound."""
    empty = np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0)
    step, pair, lower = (np.concatenate(column) for column in zip(empty, *found, strict=True))
    order = np.lexsort((pair, step))
    return Items(steps=steps, step=step[order], pair=pair[order]), lower[order]


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
