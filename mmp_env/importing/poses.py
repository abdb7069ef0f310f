"""The poses `home` and `tucked` of an imported arm: free of self-collision for its geometry and all sphere sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from mmp_env.importing.arm_geometry import ArmGeometry
from mmp_env.importing.chain import Chain
from mmp_env.importing.self_pairs import contact_counts, self_clearance
from mmp_env.model.robot import EXACT

_TRIED = 400
_CLEAR_M = 0.005
_DECIMALS = 4


def given_poses(chain: Chain) -> list[Float[np.ndarray, "dof"]]:
    """Returns poses that the source suggests: those of its keyframes, zero, and the middle of the ranges."""
    model = chain.source.model
    address = [int(model.jnt_qposadr[j]) for j in chain.joints]
    named = sorted(range(model.nkey), key=lambda k: model.key(k).name != "home")
    return [np.array(model.key_qpos[k][address]) for k in named] + [np.array(model.qpos0[address])]


def choose_poses(
    arm: ArmGeometry,
    mjcf: str,
    pairs: Mapping[str, Sequence[tuple[int, int]]],
    given: Sequence[Float[np.ndarray, "dof"]],
    drawn: Float[np.ndarray, "n dof"],
    least: int = 1,
) -> tuple[Float[np.ndarray, "dof"], Float[np.ndarray, "dof"]] | None:
    """Returns `home` and `tucked`, or None where too few poses are free.

    Args:
        arm: The arm.
        mjcf: Its MJCF.
        pairs: Sphere set -> pairs of links that it tests.
        given: Poses that are taken as `home` if they are free, the first one first.
        drawn: Random configurations, free for the geometry, from which the others come.
        least: Number of poses that must be free.
    """
    span = arm.upper - arm.lower
    inside = [q for q in given if ((q >= arm.lower) & (q <= arm.upper)).all()]
    inside = [np.clip(q, arm.lower + 1e-3 * span, arm.upper - 1e-3 * span) for q in inside]
    tried = np.round(np.array([*inside, *drawn[:_TRIED]]).reshape(-1, len(span)), _DECIMALS)
    clearance = np.full(len(tried), np.inf)
    for name, covers in arm.covers.items():
        if name != EXACT:  # whose spheres may overlap
            clearance = np.minimum(clearance, self_clearance(arm, covers, pairs[name], tried))
    low, wide = _extent(arm, tried)
    clearance = np.minimum(clearance, 1.0)  # infinite where no pair is tested
    overlaps, _ = contact_counts(arm, mjcf, tried)
    tested = set().union(*pairs.values())
    for pair, rows in overlaps.items():
        if pair in tested:
            clearance[rows] = np.minimum(clearance[rows], -1.0)
    free = clearance > 0
    if free.sum() < least:
        return None
    given_free = np.flatnonzero(free[: len(inside)] & (clearance[: len(inside)] > 0))
    good = free & (clearance >= min(_CLEAR_M, float(np.median(clearance[free]))))
    # Above the plane that the arm stands on, if any pose is.
    above = good & (low >= min(0.0, float(low[good].max())))
    home = tried[given_free[0]] if len(given_free) else tried[np.flatnonzero(above)[clearance[above].argmax()]]
    tucked = tried[np.flatnonzero(above)[wide[above].argmin()]]
    return home, tucked


def _extent(arm: ArmGeometry, q: Float[np.ndarray, "n dof"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """The lowest point and the largest distance from the base's z axis [m] of the moving links' spheres."""
    poses = arm.kinematics.link_poses(q)
    low, wide = np.full(len(q), np.inf), np.zeros(len(q))
    for k, cover in enumerate(list(arm.covers.values())[-1]):
        if k == 0 or cover is None:
            continue
        points = cover.centers @ poses[k][:, :3, :3].transpose(0, 2, 1) + poses[k][:, None, :3, 3]
        if k > 1:
            low = np.minimum(low, (points[..., 2] - cover.radii).min(axis=1))
        wide = np.maximum(wide, (np.hypot(points[..., 0], points[..., 1]) + cover.radii).max(axis=1))
    return low, wide
