"""The proof that tool axes stay within their bounds of the world's z axis at every instant.

The directions within an angle of z form a convex cone, since no bound exceeds a right angle. Let f be the signed
distance of the tip of the tool's unit axis from the cone's surface, positive inside. Between two poses the tip deviates
from its chord by S^2 / 8 at most, where S is the sum of the joints' turns: no second derivative of a unit vector on a
chain of hinges exceeds S^2. As f is concave and no steeper than 1, f >= min(f_start, f_end) - S^2 / 8 in each step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedArm, CheckedPlan
from mmp_env.check.keep import CheckedUpright
from mmp_env.check.model import CellModel, Poses
from mmp_env.check.report import Violation
from mmp_env.check.trajectory import PlacedTrajectory, Trajectory
from mmp_env.mujoco_import import mujoco

TOLERANCE_RAD = 1e-6
"""Tolerance [rad] of bounds, the same as that of start and goal."""
_RESOLUTION = 1e-9
"""Resolution of f. A step whose bound is this close to its ends is not bisected further."""
_BLOCK = 4096
"""Largest number of steps that are placed at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Axis:
    """A tool axis: `direction` [3] in the frame of a body, and how much each joint turns it at most, `turns` [n]."""

    body: int
    direction: Float[np.ndarray, "3"]
    turns: Float[np.ndarray, "n"]


@dataclass(frozen=True, kw_only=True)
class _Breach:
    """An instant [s] at which the axis is `angle` [rad] from z, or may be nearby if that was not `found`."""

    time: float
    angle: float
    found: bool


def upright(plan: CheckedPlan, model: CellModel) -> Iterator[Violation]:
    """Yields a violation for every arm whose tool axis leaves its bound, or cannot be proved to keep it."""
    trajectory = Trajectory(plan.times, plan.positions)
    for arm in plan.cell.arms:
        if arm.name not in plan.keep:
            continue
        bound = plan.keep[arm.name]
        if breaches := _breaches(model, _axis(model, arm, bound), bound.within, trajectory):
            yield _violation(arm.name, bound.within, breaches)


def _axis(model: CellModel, arm: CheckedArm, bound: CheckedUpright) -> _Axis:
    if arm.tool:
        body, direction = model.mujoco.body(f"{arm.name}/{arm.tool.name}").id, bound.axis
    else:
        site = model.mujoco.site(f"{arm.name}/flange")
        body, rotation = int(site.bodyid[0]), np.empty(9)
        mujoco.mju_quat2Mat(rotation, site.quat)
        direction = rotation.reshape(3, 3) @ bound.axis
    return _Axis(body=body, direction=direction, turns=np.where(model.slides, 0.0, model.moves(body).astype(float)))


def _breaches(model: CellModel, axis: _Axis, within: float, trajectory: Trajectory) -> list[_Breach]:
    places, out = trajectory.grid(), []
    for first in range(0, len(places) - 1, _BLOCK):
        track = PlacedTrajectory(model, trajectory, places[first : first + _BLOCK + 1])
        while len(track.steps.start):
            inside, angle = _inside(axis, within + TOLERANCE_RAD, track.poses)
            steps = track.steps
            stray = (steps.move @ axis.turns) ** 2 / 8 + steps.bend @ axis.turns
            ends = np.minimum(inside[steps.start], inside[steps.end])
            bad, proved = ~(ends >= 0), ends - stray >= 0
            final = ~bad & ~proved & ~(stray > _RESOLUTION)
            for k in np.flatnonzero(bad | final):
                worst = max(steps.start[k], steps.end[k], key=lambda pose: angle[pose])
                out.append(_Breach(time=float(track.poses.times[worst]), angle=float(angle[worst]), found=bool(bad[k])))
            track.halve(np.flatnonzero(~bad & ~proved & ~final))
    return out


def _inside(axis: _Axis, within: float, poses: Poses) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
    """Returns how far the tip of the axis is inside the cone, and the angle of the axis [rad]."""
    x, y, z = np.moveaxis(poses.rotations[:, axis.body] @ axis.direction, -1, 0)
    across = np.hypot(x, y)
    return z * np.sin(within) - across * np.cos(within), np.arctan2(across, z)


def _violation(arm: str, within: float, breaches: list[_Breach]) -> Violation:
    worst = max(breaches, key=lambda breach: (breach.found, breach.angle))
    first, last = (edge(breach.time for breach in breaches) for edge in (min, max))
    span = "" if first == last else f" (too far from {first:.3f} to {last:.3f} s)"
    text = f"the tool axis of arm '{arm}' is {worst.angle:.6f} rad from the world's z axis at {worst.time:.3f} s{span}"
    return Violation(
        rule="upright",
        message=f"{'' if worst.found else 'not proved: around an instant '}{text}; {within:g} rad are allowed",
        time_s=worst.time,
        arms=(arm,),
        values={"angle_rad": worst.angle, "within_rad": within, "from_s": first, "to_s": last, "found": worst.found},
    )
