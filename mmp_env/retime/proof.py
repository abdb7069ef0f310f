"""The sampled motion along a smoothed path, and the proof that it is free of conflicts."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core
from mmp_env.errors import UnprovedPlanError
from mmp_env.model.certificate import Certificate, certify
from mmp_env.model.plan import Plan
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import LEAST_LENGTH_S, PathTiming, run_clock
from mmp_env.retime.limits import RateLimits, split
from mmp_env.retime.smoothing import covering, narrowed, smooth
from mmp_env.retime.steps import Steps, finished
from mmp_env.retime.zones import zones_of
from mmp_env.sim.servo_reference import Reference

_LONG_S = 1e9
"""Time limit of a proof [s], longer than any proof."""
_STRAY_RAD, _MOST_PARTS = 5e-6, 64
"""Largest deviation [rad] of the followed curve from lines between the proved points; most points in a sample."""
_PROOFS = 12
"""Largest number of proofs, each with narrower blends after a failure. Then the motion stops at every corner."""

_ROWS_AT_ONCE = 1024
"""Points of the followed curve computed at once; bounds the memory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProvedMotion:
    """A `motion` along `path` that keeps `clearance_m` [m] at every instant."""

    path: BlendedPath
    motion: Plan
    clearance_m: float


def proved_motion(plan: Plan, path: BlendedPath, limits: RateLimits, tolerance: float, period_s: float) -> ProvedMotion:
    """Returns the motion along `path` with a sample every `period_s` [s], and its proof.

    Narrows blends where the proof fails, and where a quick test then finds further conflicts, finally to stops. Raises
    `MmpError` for a plan that cannot be proved as it is.
    """
    widest, attempts = path.width, 0
    while True:
        clock = finished(_timed(path, limits, period_s))
        motion, attempts = finished(_sampled(plan, path, clock)), attempts + 1
        certificate, row_of = _certified(motion, _bending(path, clock.phase))
        if certificate.valid:
            return ProvedMotion(path=path, motion=motion, clearance_m=certificate.clearance)
        if not (path.width > 0).any():
            raise UnprovedPlanError(
                "the plan cannot be proved clear of conflicts as it is, so it is not retimed; see mmp check"
            )
        row = np.interp(certificate.instant, np.arange(len(row_of)), row_of)
        near = covering(path, np.interp([row], np.arange(len(clock.phase)), clock.phase))
        if near.any() and attempts < _PROOFS:
            path = finished(smooth(plan.problem, narrowed(path, near, widest), tolerance))
        else:
            path = path.narrower(np.zeros_like(widest))


def _certified(motion: Plan, kept: Int[np.ndarray, "k"]) -> tuple[Certificate, Float[np.ndarray, "m"]]:
    """Returns a certificate of a motion, and the row of `motion` at each point that it was made for.

    The lines between the rows `kept` are proved first: most failures show there, in a shorter time.
    """
    rows = {name: q[kept] for name, q in motion.positions.items()}
    bending = Plan(problem=motion.problem, times=motion.times[kept], positions=rows)
    certificate = certify(bending, core.Clock(_LONG_S), share=1.0)
    if not certificate.valid:
        return certificate, kept.astype(float)
    del rows, bending  # large in cells of many arms
    followed, row_of = _followed(motion, kept)
    return certify(followed, core.Clock(_LONG_S), share=1.0), row_of


def unproved_motion(plan: Plan, path: BlendedPath, limits: RateLimits, period_s: float) -> Steps[Plan]:
    """Returns, in steps, the motion along `path` with a sample every `period_s` [s], without a proof."""
    clock = yield from _timed(path, limits, period_s)
    yield
    return (yield from _sampled(plan, path, clock))


def _timed(path: BlendedPath, limits: RateLimits, period_s: float) -> Steps[PathTiming]:
    if path.course.end > LEAST_LENGTH_S:
        zones = yield from zones_of(path, limits)
        yield
        return run_clock(zones, period_s)
    still = np.zeros(2)  # nothing moves
    return PathTiming(period_s=period_s, phase=still, speed=still, growth=still)


def _sampled(plan: Plan, path: BlendedPath, clock: PathTiming) -> Steps[Plan]:
    speed, growth, first = clock.speed[:, None], clock.growth[:, None], 0
    positions, velocities, accelerations = {}, {}, {}
    for arm in plan.problem.cell.arms:  # one at a time, within the processor's cache
        joints = slice(first, first + arm.dof)
        q, slope, curve = path.derivatives(clock.phase, (0, 1, 2), joints)
        q[0], q[-1] = path.course.q[0, joints], path.course.q[-1, joints]
        positions[arm.name], velocities[arm.name], accelerations[arm.name] = (
            np.ascontiguousarray(part) for part in (q, slope * speed, curve * speed**2 + slope * growth)
        )
        first += arm.dof
        yield
    return dataclasses.replace(
        plan,
        times=clock.period_s * np.arange(len(clock.phase)),
        positions=positions,
        velocities=velocities,
        accelerations=accelerations,
    )


def _followed(motion: Plan, kept: Int[np.ndarray, "k"]) -> tuple[Plan, Float[np.ndarray, "m"]]:
    """Returns the curve that an execution follows, and the row of `motion` at each of its points.

    The curve passes inside of the samples. It strays by `_STRAY_RAD` at most from the lines between the points.
    """
    reference = Reference(motion, motion.problem.start)
    period_s = float(motion.times[1] - motion.times[0])
    growth = max(float(np.abs(a).max(initial=0.0)) for a in (motion.accelerations or {}).values())
    parts = int(np.clip(np.ceil(period_s * np.sqrt(growth / (8 * _STRAY_RAD))), 1, _MOST_PARTS))
    rows = np.unique(np.clip(np.concatenate([kept - 1, kept, kept + 1]), 0, len(motion.times) - 1))
    bent = rows[:-1][np.diff(rows) == 1]
    row = np.unique(np.concatenate([rows, (bent[:, None] + np.arange(1, parts) / parts).ravel()]))
    positions = {name: np.empty((len(row), q.shape[1])) for name, q in motion.positions.items()}
    for block in np.array_split(np.arange(len(row)), len(row) // _ROWS_AT_ONCE + 1):
        for name, q in split(motion.problem.cell, reference.at(row[block] * period_s)[0]).items():
            positions[name][block] = q
    return Plan(problem=motion.problem, times=row * period_s, positions=positions), row


def _bending(path: BlendedPath, phase: Float[np.ndarray, "t"]) -> Int[np.ndarray, "k"]:
    """Returns the rows in blends and next to them. The path is straight between these rows."""
    edges = np.zeros(len(phase) + 2, int)
    np.add.at(edges, np.maximum(np.searchsorted(phase, path.corners - path.reach) - 1, 0), 1)
    np.add.at(edges, np.searchsorted(phase, path.corners + path.reach, side="right") + 1, -1)
    kept = np.cumsum(edges)[: len(phase)] > 0
    kept[[0, -1]] = True
    return np.flatnonzero(kept)
