"""The volumes that rigid parts of arms sweep in windows of a schedule, and the clearance of two of them.

In each period a sphere moves along its chord, but for a deviation that `ChordDeviation` bounds. The clearance of two
windows is that of all chords of one from all chords of the other, less radii and deviations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.checked import Solid
from mmp_env.check.items import MotionSteps
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import ChordDeviation
from mmp_env.check.schedule_motion import Motion

_BATCH = 200_000
"""Pairs of chords that are measured at once; bounds the memory of a check."""

_ROUNDING_M2 = 1e-9
"""Rounding error of squared distances [m^2] that are computed from products."""
_BEFORE = 1
"""Periods before the schedule, in which the arms rest."""

_STEPS = 2000
"""Periods whose deviations are computed at once; bounds the memory of a check."""

Window = tuple[str, int, int, int | None]
"""An arm, the instants [periods] between which it moves, and the number of what it holds; None for nothing more.

A window of one instant gets the period before it.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Balls:
    """Balls [m] around parts [p] in periods `steps` [u], and a box around those of each part."""

    parts: Int[np.ndarray, "p"]
    steps: Int[np.ndarray, "u"]
    centers: Float[np.ndarray, "p u 3"]
    radii: Float[np.ndarray, "p u"]
    low: Float[np.ndarray, "p 3"]
    high: Float[np.ndarray, "p 3"]


class SweptParts:
    """Parts of all arms at all periods of a schedule.

    Args:
        model: the cell.
        motions: arm name -> its motion.
        holds: arms, and objects that they hold at some time.
    """

    def __init__(
        self, model: CellModel, motions: Mapping[str, Motion], holds: Sequence[tuple[str, Solid]] = ()
    ) -> None:
        self.period = next(iter(motions.values())).period
        names = [arm.name for arm in model.cell.arms]
        self._parts, self._clouds = sphere_parts(model, [(names.index(arm), solid) for arm, solid in holds])
        self._links = len(self._clouds) - len(holds)
        count = max(len(motion.controls) for motion in motions.values()) + 1
        times = self.period * (np.arange(count) - _BEFORE)
        self._poses = model.poses(times, np.concatenate([motions[name].at(times) for name in names], axis=1))
        bends = [np.pad(motions[name].bend(), ((_BEFORE, count), (0, 0)))[: count - 1] for name in names]
        move = np.abs(np.diff(self._poses.q, axis=0))
        bend = np.concatenate(bends, axis=1)
        bound = ChordDeviation(model, self._parts.arm, self._parts.reach)
        some = [slice(k, min(k + _STEPS, count - 1)) for k in range(0, count - 1, _STEPS)]
        numbers = np.arange(count)
        self._deviation = np.concatenate(
            [bound.all(MotionSteps(start=numbers[k], end=numbers[k] + 1, move=move[k], bend=bend[k])) for k in some]
        )
        # Held objects are added where they are held.
        moving = self._parts.moves.any(axis=1) & (np.arange(len(self._clouds)) < self._links)
        self._known: dict[Window, _Balls] = {}
        self._moved: dict[int, tuple[Float[np.ndarray, "k s 3"], Float[np.ndarray, "u s"]]] = {}
        self._of_arm = {name: np.flatnonzero((self._parts.arm == k) & moving) for k, name in enumerate(names)}

    def near(self, ones: Sequence[Window], others: Sequence[Window], enough: float) -> Bool[np.ndarray, "n m"]:
        """Returns which windows of two arms have boxes around parts that are nearer to each other than `enough` [m]."""
        low, high = self._boxes(others)
        out = np.empty((len(ones), len(others)), dtype=bool)
        for k, window in enumerate(ones):
            box = self._balls(window)
            gaps = np.maximum(box.low[:, None, None] - high, low - box.high[:, None, None])
            out[k] = (np.einsum("pmqc,pmqc->pmq", *2 * [np.maximum(gaps, 0)]) < enough * enough).any(axis=(0, 2))
        return out

    def _boxes(self, windows: Sequence[Window]) -> tuple[Float[np.ndarray, "m q 3"], Float[np.ndarray, "m q 3"]]:
        """Returns the boxes of all parts in windows; parts that a window does not have are infinitely far away."""
        balls = [self._balls(window) for window in windows]
        low = np.full((len(balls), max(len(b.parts) for b in balls), 3), np.inf)
        high = np.full_like(low, -np.inf)
        for k, ball in enumerate(balls):
            low[k, : len(ball.parts)], high[k, : len(ball.parts)] = ball.low, ball.high
        return low, high

    def clearance(self, one: Window, other: Window, enough: float) -> float:
        """Returns a lower bound on the clearance of two windows of two arms [m]; `enough` [m] if it is larger."""
        least, (a, b) = enough, (self._balls(window) for window in (one, other))
        gaps = np.maximum(np.maximum(a.low[:, None] - b.high, b.low - a.high[:, None]), 0)
        for p, q in np.argwhere(np.linalg.norm(gaps, axis=2) < enough):
            u, v = _where(_overlapping(a.centers[p], a.radii[p] + least, b.centers[q], b.radii[q]))
            if len(u):
                steps = np.stack([a.steps[u], b.steps[v]], axis=1)
                least = min(least, self._measured(int(a.parts[p]), int(b.parts[q]), steps, least))
        return least

    def _balls(self, window: Window) -> _Balls:
        """Returns balls around the parts of an arm in each period of a window."""
        if window in self._known:
            return self._known[window]
        arm, begin, end, hold = window
        parts, poses = self._of_arm[arm], self._poses
        if hold is not None:
            parts = np.append(parts, self._links + hold)
        steps = np.arange(min(begin, end - 1), end + 1) + _BEFORE
        body = self._parts.body[parts]
        turned = np.einsum("upij,pj->upi", poses.rotations[steps[:, None], body], self._parts.center[parts])
        at = poses.positions[steps[:, None], body] + turned
        # No point of a part is farther from its place in the middle of a period than half its own chord.
        chords = [np.diff(self._centers(int(part), steps), axis=0) for part in parts]
        half = np.array([np.linalg.norm(chord, axis=2).max(axis=1) / 2 for chord in chords])
        centers = ((at[1:] + at[:-1]) / 2).transpose(1, 0, 2)
        radii = self._parts.radius[parts][:, None] + half + self._deviation[steps[:-1]][:, parts].T
        out = _Balls(
            parts=parts,
            steps=steps[:-1],
            centers=centers,
            radii=radii,
            low=(centers - radii[..., None]).min(axis=1),
            high=(centers + radii[..., None]).max(axis=1),
        )
        self._known[window] = out
        return out

    def _chords(
        self, part: int, steps: Int[np.ndarray, "m"]
    ) -> tuple[Float[np.ndarray, "m s 3"], Float[np.ndarray, "m s 3"], Float[np.ndarray, "m s"]]:
        """Returns the centres of the spheres of a part at the begin and at the end of periods, and half their moves."""
        if part >= self._links:  # an object is held for a small part of the schedule
            a, b = self._centers(part, steps), self._centers(part, steps + 1)
            return a, b, np.linalg.norm(b - a, axis=2) / 2
        if part not in self._moved:
            centers = self._centers(part, np.arange(len(self._poses.times)))
            self._moved[part] = centers, np.linalg.norm(np.diff(centers, axis=0), axis=2) / 2
        centers, half = self._moved[part]
        return centers[steps], centers[steps + 1], half[steps]

    def _centers(self, part: int, steps: Int[np.ndarray, "m"]) -> Float[np.ndarray, "m s 3"]:
        body, points = self._parts.body[part], self._clouds[part].centers
        return self._poses.positions[steps, body][:, None] + points @ self._poses.rotations[steps, body].transpose(
            0, 2, 1
        )

    def _measured(self, first: int, second: int, steps: Int[np.ndarray, "n 2"], enough: float) -> float:
        """Returns the least clearance of two parts in pairs of periods [m]; `enough` if it is larger."""
        clouds = self._clouds[first], self._clouds[second]
        size, least = max(_BATCH // (len(clouds[0].radii) * len(clouds[1].radii)), 1), enough
        for k in range(0, len(steps), size):
            some = steps[k : k + size]
            (a, a_end, half, wanted), (b, b_end, half_b, wanted_b) = (
                (*self._chords(part, some[:, n]), clouds[n].radii + self._deviation[some[:, n], part][:, None])
                for n, part in enumerate((first, second))
            )
            near = _overlapping((a + a_end) / 2, wanted + half + least, (b + b_end) / 2, wanted_b + half_b)
            step, i, j = _where(near)
            if len(step):
                apart = chord_distances(a[step, i], a_end[step, i], b[step, j], b_end[step, j])
                least = min(least, float((apart - (wanted[step, i] + wanted_b[step, j])).min()))
        return least


def chord_distances(
    a: Float[np.ndarray, "*#n 3"],
    a_end: Float[np.ndarray, "*#n 3"],
    b: Float[np.ndarray, "*#n 3"],
    b_end: Float[np.ndarray, "*#n 3"],
) -> Float[np.ndarray, "..."]:
    """Returns the distances of two straight chords each: at an end of one of them, or between two inner points."""
    along, other, between = a_end - a, b_end - b, a - b
    ends = [_from_chord(p, q, r) for p, q, r in ((a, b, b_end), (a_end, b, b_end), (b, a, a_end), (b_end, a, a_end))]
    least = np.minimum.reduce(ends)
    uu, uv, vv = _dot(along, along), _dot(along, other), _dot(other, other)
    uw, vw = _dot(along, between), _dot(other, between)
    square = uu * vv - uv * uv
    inner = square > 0
    safe = np.where(inner, square, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inner &= (s > 0) & (s < 1) & (t > 0) & (t < 1)
    gap = np.linalg.norm(between + s[..., None] * along - t[..., None] * other, axis=-1)
    return np.where(inner, np.minimum(least, gap), least)


def _overlapping(
    a: Float[np.ndarray, "*n s 3"],
    reach: Float[np.ndarray, "*n s"],
    b: Float[np.ndarray, "*n t 3"],
    reach_b: Float[np.ndarray, "*n t"],
) -> Bool[np.ndarray, "*n s t"]:
    """Returns which balls of two sets overlap, and perhaps those that touch. `reach` are radii [m].

    |a - b|^2 - (r + r_b)^2 is one product of two vectors: (a, r, |a|^2 - r^2, 1) and (-2 b, -2 r_b, 1, |b|^2 - r_b^2).
    """
    one, other = np.ones((*reach.shape, 6)), np.ones((*reach_b.shape, 6))
    one[..., :3], one[..., 3], one[..., 4] = a, reach, np.einsum("...i,...i->...", a, a) - reach * reach
    other[..., :3], other[..., 3] = -2 * b, -2 * reach_b
    other[..., 5] = np.einsum("...i,...i->...", b, b) - reach_b * reach_b
    return one @ np.swapaxes(other, -1, -2) < _ROUNDING_M2


def _where(mask: Bool[np.ndarray, "..."]) -> tuple[Int[np.ndarray, "k"], ...]:
    """Returns what `np.nonzero` returns; few true values in many are found sooner in one dimension."""
    return np.unravel_index(np.flatnonzero(mask), mask.shape)


def _from_chord(
    point: Float[np.ndarray, "*#n 3"], begin: Float[np.ndarray, "*#n 3"], end: Float[np.ndarray, "*#n 3"]
) -> Float[np.ndarray, "..."]:
    along, off = end - begin, point - begin
    length = _dot(along, along)
    share = np.clip(
        np.divide(_dot(off, along), length, out=np.zeros_like(length + off[..., 0]), where=length > 0), 0, 1
    )
    return np.linalg.norm(off - share[..., None] * along, axis=-1)


def _dot(a: Float[np.ndarray, "*#n 3"], b: Float[np.ndarray, "*#n 3"]) -> Float[np.ndarray, "..."]:
    return np.einsum("...i,...i->...", *np.broadcast_arrays(a, b))
