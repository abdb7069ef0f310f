"""Arms of six hinges with a special geometry that has a closed form, for many samples at once.

A sample is a chain of six hinges in the notation of `SerialChain` together with a target. The chains of samples may
differ, for example by the position of a locked joint.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.subproblems import (
    angle_between,
    angles_of_height,
    cross,
    dot,
    perpendicular,
    rotated,
)

_MISS = 0.05
"""Largest error of the wrist's position [arm lengths] of starts of a refinement."""


class Samples(NamedTuple):
    """Chains of six hinges, and targets of their last frame, which is parallel to the base frame at zero positions."""

    axes: Float[np.ndarray, "m 6 3"]
    offsets: Float[np.ndarray, "m 7 3"]
    rotation: Float[np.ndarray, "m 3 3"]
    position: Float[np.ndarray, "m 3"]

    def take(self, rows: Int[np.ndarray, "n"]) -> Samples:
        """Returns some of the samples, perhaps repeatedly."""
        return Samples(*(part[rows] for part in self))

    @property
    def points(self) -> Float[np.ndarray, "m 7 3"]:
        """Points on the axes, and the last frame, at zero positions [m]."""
        return np.cumsum(self.offsets, axis=1)

    def reversed(self) -> Samples:
        """Returns the samples from the last frame to the base."""
        back = self.rotation.transpose(0, 2, 1)
        position = -(back @ self.position[:, :, None])[:, :, 0]
        return Samples(-self.axes[:, ::-1], -self.offsets[:, ::-1], back, position)


def spherical_wrist(samples: Samples) -> tuple[Float[np.ndarray, "n 6"], Int[np.ndarray, "n"]]:
    """Returns joint angles [rad] of arms whose last three axes meet, and the index of the sample of each.

    The first three joints bring the wrist to its place: a quartic equation for joint 3 and linear ones for joints 2 and
    1. The others turn the tool.
    """
    h, points = samples.axes, samples.points
    wrist = meeting_point(points[:, 3:6], h[:, 3:6])
    first, second, third = samples.offsets[:, 1], samples.offsets[:, 2], wrist - points[:, 2]
    target = samples.position - _turned(samples.rotation, points[:, 6] - wrist) - samples.offsets[:, 0]
    length = np.linalg.norm([first, second, third], axis=2).sum(axis=0)
    q3 = _elbow_angles(h, first, second, third, target)
    rows, column = np.nonzero(np.isfinite(q3))
    q3 = q3[rows, column]
    h, first, target = h[rows], first[rows], target[rows]
    reach = second[rows] + rotated(h[:, 2], q3, third[rows])
    q2 = _shoulder_angles(h, first, reach, target)
    rows, q3 = np.repeat(rows, 2), np.repeat(q3, 2)
    h, first, target, reach = (np.repeat(part, 2, axis=0) for part in (h, first, target, reach))
    q2 = q2.ravel()
    arm = first + rotated(h[:, 1], q2, reach)
    q1 = angle_between(h[:, 0], arm, target)
    near = np.linalg.norm(rotated(h[:, 0], q1, arm) - target, axis=1) < _MISS * length[rows]
    rows, front = rows[near], np.column_stack([q1, q2, q3])[near]
    return _with_wrist(samples, rows, front)


def parallel_axes(samples: Samples) -> tuple[Float[np.ndarray, "n 6"], Int[np.ndarray, "n"]]:
    """Returns joint angles [rad] of arms whose axes 2, 3 and 4 are parallel and whose axes 5 and 6 meet.

    The parallel joints keep heights and directions along their axis, which gives joints 1, 5 and 6; the three joints
    themselves are a planar arm.
    """
    h, points, count = samples.axes, samples.points, len(samples.position)
    wrist = meeting_point(points[:, 4:6], h[:, 4:6])
    target = samples.position - _turned(samples.rotation, points[:, 6] - wrist) - samples.offsets[:, 0]
    up, last = h[:, 1], wrist - points[:, 3]
    height = dot(up, samples.offsets[:, 1:4].sum(axis=1) + last)
    q1 = angles_of_height(-h[:, 0], target, up, height).ravel()
    rows = np.repeat(np.arange(count), 2)
    h, up, rotation = h[rows], up[rows], samples.rotation[rows]
    seen = _turned(rotation.transpose(0, 2, 1), rotated(h[:, 0], q1, up))
    q5 = angles_of_height(h[:, 4], h[:, 5], up, dot(seen, h[:, 5])).ravel()
    rows, q1 = np.repeat(rows, 2), np.repeat(q1, 2)
    h, up, seen, rotation = (np.repeat(part, 2, axis=0) for part in (h, up, seen, rotation))
    q6 = angle_between(h[:, 5], seen, rotated(-h[:, 4], q5, up))
    side = perpendicular(up)
    back = rotated(-h[:, 5], q6, rotated(-h[:, 4], q5, side))
    sum_of_three = angle_between(up, side, rotated(-h[:, 0], q1, _turned(rotation, back)))
    upper, fore = samples.offsets[rows, 2], samples.offsets[rows, 3]
    place = rotated(-h[:, 0], q1, target[rows]) - samples.offsets[rows, 1] - rotated(up, sum_of_three, last[rows])
    flat = place - dot(place, up)[:, None] * up
    lift = dot(upper + fore, up)
    squared = dot(flat, flat) + lift**2
    q3 = angles_of_height(up, fore, upper, (squared - dot(upper, upper) - dot(fore, fore)) / 2).ravel()
    rows, q1, q5, q6, sum_of_three = (np.repeat(part, 2) for part in (rows, q1, q5, q6, sum_of_three))
    up, upper, fore, flat = (np.repeat(part, 2, axis=0) for part in (up, upper, fore, flat))
    q2 = angle_between(up, upper + rotated(up, q3, fore), flat)
    q3_sign, q4_sign = (np.sign(dot(up, samples.axes[rows, k])) for k in (2, 3))
    return np.column_stack([q1, q2, q3 * q3_sign, (sum_of_three - q2 - q3) * q4_sign, q5, q6]), rows


def meeting_point(points: Float[np.ndarray, "m k 3"], axes: Float[np.ndarray, "m k 3"]) -> Float[np.ndarray, "m 3"]:
    """Returns the point [m] nearest to lines through points along unit vectors. The lines must not be all parallel."""
    across = np.eye(3) - axes[..., :, None] * axes[..., None, :]
    return np.linalg.solve(across.sum(axis=1), (across @ points[..., None]).sum(axis=1))[:, :, 0]


def _elbow_angles(
    h: Float[np.ndarray, "m 6 3"],
    first: Float[np.ndarray, "m 3"],
    second: Float[np.ndarray, "m 3"],
    third: Float[np.ndarray, "m 3"],
    target: Float[np.ndarray, "m 3"],
) -> Float[np.ndarray, "m 4"]:
    """Returns the angles of joint 3 [rad] with which the wrist reaches its target; nan where a root is not real.

    The distance of the wrist from the first joint, and its height along the first axis, are linear in the cosine and
    the sine of joint 2. Both of them together leave one equation for joint 3.
    """
    h1, h2, h3 = h[:, 0], h[:, 1], h[:, 2]
    inner = _series(second, h3, third)
    along = _series(h2, h3, third) + _constant(dot(h2, second))
    squared = 2 * inner + _constant(dot(second, second) + dot(third, third))
    lift = dot(h2, first)
    alpha = _constant((dot(target, target) - dot(first, first)) / 2) - squared / 2 - lift[:, None] * along
    beta = _constant(dot(h1, target) - dot(h1, first)) - dot(h1, h2)[:, None] * along
    o, g = first - lift[:, None] * h2, h1 - dot(h1, h2)[:, None] * h2
    turn = dot(h2, cross(o, g))
    equation = (
        dot(g, g)[:, None] * _product(alpha, alpha)
        - 2 * dot(o, g)[:, None] * _product(alpha, beta)
        + dot(o, o)[:, None] * _product(beta, beta)
    )
    outer = np.zeros_like(equation)
    outer[:, 1:4] = squared
    return _angles_of_roots(equation - turn[:, None] ** 2 * (outer - _product(along, along)))


def _shoulder_angles(
    h: Float[np.ndarray, "n 6 3"],
    first: Float[np.ndarray, "n 3"],
    reach: Float[np.ndarray, "n 3"],
    target: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "n 2"]:
    """Returns both angles of joint 2 [rad] from the height of the wrist, or from its distance if axes 1 and 2 align."""
    by_height = angles_of_height(h[:, 1], reach, h[:, 0], dot(h[:, 0], target - first))
    distance = (dot(target, target) - dot(first, first) - dot(reach, reach)) / 2
    by_distance = angles_of_height(h[:, 1], reach, first, distance)
    return np.where((np.abs(dot(h[:, 0], h[:, 1])) < 0.99)[:, None], by_height, by_distance)


def _with_wrist(
    samples: Samples, rows: Int[np.ndarray, "k"], front: Float[np.ndarray, "k 3"]
) -> tuple[Float[np.ndarray, "n 6"], Int[np.ndarray, "n"]]:
    """Returns angles of all joints from those of the first three: the wrist has two solutions each."""
    h, rotation = samples.axes[rows], samples.rotation[rows]

    def unturned(vector: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
        for k in range(3):
            vector = rotated(-h[:, k], front[:, k], vector)
        return vector

    tool = unturned(_turned(rotation, h[:, 5]))
    q5 = angles_of_height(h[:, 4], h[:, 5], h[:, 3], dot(h[:, 3], tool)).ravel()
    side = perpendicular(h[:, 5])
    turned_side = unturned(_turned(rotation, side))
    rows, front = np.repeat(rows, 2), np.repeat(front, 2, axis=0)
    h, tool, side, turned_side = (np.repeat(part, 2, axis=0) for part in (h, tool, side, turned_side))
    q4 = angle_between(h[:, 3], rotated(h[:, 4], q5, h[:, 5]), tool)
    q6 = angle_between(h[:, 5], side, rotated(-h[:, 4], q5, rotated(-h[:, 3], q4, turned_side)))
    return np.column_stack([front, q4, q5, q6]), rows


def _turned(rotation: Float[np.ndarray, "m 3 3"], vector: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "m 3"]:
    return (rotation @ vector[:, :, None])[:, :, 0]


def _series(
    direction: Float[np.ndarray, "m 3"], axis: Float[np.ndarray, "m 3"], vector: Float[np.ndarray, "m 3"]
) -> np.ndarray:
    """Returns direction . rotated vector as a polynomial in exp(i angle): coefficients of powers -1, 0, 1."""
    mean = dot(direction, axis) * dot(axis, vector)
    cosine, sine = dot(direction, vector) - mean, dot(direction, cross(axis, vector))
    wave = (cosine - 1j * sine) / 2
    return np.stack([wave.conj(), mean, wave], axis=1)


def _constant(value: Float[np.ndarray, "m"]) -> np.ndarray:
    zero = np.zeros_like(value)
    return np.stack([zero, value, zero], axis=1)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the product of two polynomials, coefficients of powers -2 to 2."""
    out = np.zeros((len(a), 5), dtype=complex)
    for k in range(3):
        out[:, k : k + 3] += a[:, k, None] * b
    return out


def _angles_of_roots(polynomial: np.ndarray) -> Float[np.ndarray, "m 4"]:
    """Returns the angles of the roots near the unit circle; double roots are accurate to half the digits only."""
    size = np.abs(polynomial).max(axis=1)
    leading = polynomial[:, 4]
    leading = np.where(np.abs(leading) > 1e-14 * size, leading, 1e-14 * size + 1e-300)
    companion = np.zeros((len(polynomial), 4, 4), dtype=complex)
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, :, 3] = -polynomial[:, :4] / leading[:, None]
    roots = np.linalg.eigvals(companion)
    return np.where(np.abs(np.abs(roots) - 1) < 0.1, np.angle(roots), np.nan)
