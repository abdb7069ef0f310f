"""Where an imported arm reaches from its base: measures that place it in rings and lines."""

from __future__ import annotations

import numpy as np

from mmp_env.importing.arm_geometry import ArmGeometry
from mmp_env.importing.self_pairs import SAMPLES

_LEAST_REACH_M = 1e-3
_HEIGHT_SAMPLES = 500
_ABOVE_SHARE = 0.05
"""Share of random configurations above the base plane from which on an arm can stand on a table."""
_DEEP_BASE_M = 0.05
"""Depth [m] below the base plane from which on the base link itself is not a foot that is let into a table."""
_STEP_M = 0.05


def horizontal_reach(arm: ArmGeometry, flange: np.ndarray) -> float:
    """Returns the largest horizontal distance [m] of the flange from the axis of the base in random configurations.

    For a flange that stays on this axis, as that of a lift, it is the distance of the farthest vertex in one of them.
    """
    poses = arm.kinematics.link_poses(arm.draw(SAMPLES, 1))
    reach = _farthest((poses[-1] @ flange)[:, :3, 3])
    if reach < _LEAST_REACH_M:
        placed = [
            piece.vertices @ pose[:3, :3].T + pose[:3, 3]
            for pose, pieces in zip(poses[:, 0], arm.pieces, strict=True)
            for piece in pieces
        ]
        reach = max(_farthest(np.concatenate(placed)), _LEAST_REACH_M)
    return round(reach, 3)


def ring_height(arm: ArmGeometry) -> float:
    """Returns how far [m] above a table the base must be, 0 for an arm that stands on its base.

    The arm of a torso hangs below its base in nearly all configurations. Half of them are above the table then.
    """
    depths = np.zeros(_HEIGHT_SAMPLES)
    base = 0.0
    for link, poses in enumerate(arm.kinematics.link_poses(arm.draw(_HEIGHT_SAMPLES, 2))):
        for piece in arm.pieces[link]:
            lowest = (piece.vertices @ poses[:, 2, :3].T).min(axis=0) + poses[:, 2, 3] - piece.radius
            if link == 0:
                base = max(base, -float(lowest[0]))
            else:
                depths = np.maximum(depths, -lowest)
    height = base if base > _DEEP_BASE_M else 0.0
    if np.mean(depths <= 0) < _ABOVE_SHARE:
        height = max(height, float(np.median(depths)))
    return round(float(np.ceil(height / _STEP_M)) * _STEP_M, 3)


def _farthest(points: np.ndarray) -> float:
    """Returns the largest horizontal distance of points from the origin."""
    return float(np.hypot(points[:, 0], points[:, 1]).max())
