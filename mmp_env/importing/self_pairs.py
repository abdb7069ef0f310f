"""Self-collision pairs of an arm: which pairs of links can touch, by sampling configurations.

A pair is `adjacent` (neighbours in the chain), `excluded` (by the model that the arm is part of), `always` (it overlaps
in every sample), `never` (it comes no closer than a margin in any sample), or `sometimes`. Only pairs that are
`sometimes` are tested. A sphere set is larger than the geometry: a pair whose spheres always overlap is left out of
that set alone. In set `exact` hulls decide, so the overlap of spheres leaves out no pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from mmp_env import core
from mmp_env.importing.arm_geometry import ArmGeometry
from mmp_env.importing.cover_fit import Cover
from mmp_env.model.robot import EXACT
from mmp_env.mujoco_import import mujoco

SAMPLES = 10_000
"""Number of sampled configurations."""
NEVER_M = 0.002
"""Distance [m] that a pair keeps in all samples if it never touches."""
_SPHERE_SAMPLES = 2000
_AT_ONCE = 50
"""Number of configurations after which spheres that did not overlap end a test."""


@dataclass(frozen=True, kw_only=True)
class IgnoredPair:
    """Two links that are left out of the self-collision test, of all sphere sets or of `sphere_set` alone."""

    a: str
    b: str
    reason: str
    sphere_set: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SelfPairs:
    """The pairs that are left out with their reasons, and the `tested` pairs of link numbers."""

    ignored: tuple[IgnoredPair, ...]
    tested: tuple[tuple[int, int], ...]
    free: Bool[np.ndarray, "n"]
    """Which of the sampled configurations are free for the geometry."""

    def of_set(self, sphere_set: str) -> list[tuple[str, str]]:
        """Returns the names of the pairs that a sphere set leaves out."""
        return [(pair.a, pair.b) for pair in self.ignored if pair.sphere_set in (None, sphere_set)]


def classify(
    arm: ArmGeometry,
    mjcf: str,
    apart: Set[tuple[int, int]] = frozenset(),
    *,
    seed: int = 0,
    samples: int = SAMPLES,
) -> SelfPairs:
    """Returns which pairs are left out. `mjcf` is the robot's, with excluded contacts between neighbours only.

    Pairs of links in `apart` are left out too: the source says that they do not collide.
    """
    q = arm.draw(samples, seed)
    overlaps, near = contact_counts(arm, mjcf, q)
    ignored, tested, adjacent = [], [], set(arm.neighbours())
    solid = [k for k, own in enumerate(arm.pieces) if own]
    for pair in combinations(solid, 2):
        a, b = (arm.links[k] for k in pair)
        touching = overlaps.get(pair)
        if pair in adjacent:
            ignored.append(IgnoredPair(a=a, b=b, reason="adjacent"))
        elif pair in apart:
            ignored.append(IgnoredPair(a=a, b=b, reason="excluded"))
        elif pair not in near:
            ignored.append(IgnoredPair(a=a, b=b, reason="never"))
        elif touching is not None and touching.all():
            ignored.append(IgnoredPair(a=a, b=b, reason="always"))
        else:
            tested.append(pair)
    free = np.ones(len(q), dtype=bool)
    for pair in tested:
        if pair in overlaps:
            free &= ~overlaps[pair]
    some = q[:_SPHERE_SAMPLES]
    poses = arm.kinematics.link_poses(some)
    for name, covers in arm.covers.items():
        for i, j in tested if name != EXACT else ():
            if always_overlap(poses[i], covers[i], poses[j], covers[j]):
                ignored.append(IgnoredPair(a=arm.links[i], b=arm.links[j], reason="always", sphere_set=name))
    return SelfPairs(ignored=tuple(ignored), tested=tuple(tested), free=free)


def contact_counts(
    arm: ArmGeometry, mjcf: str, q: Float[np.ndarray, "n dof"]
) -> tuple[dict[tuple[int, int], Bool[np.ndarray, "n"]], set[tuple[int, int]]]:
    """Returns, by pair of links, in which configurations they overlap, and the pairs that come near in any."""
    spec = mujoco.MjSpec.from_string(mjcf)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    for geom in spec.geoms:
        geom.margin = NEVER_M
    model = spec.compile()
    data = mujoco.MjData(model)
    number = {model.body(name).id: k for k, name in enumerate(arm.links)}
    overlaps: dict[tuple[int, int], np.ndarray] = {}
    near: set[tuple[int, int]] = set()
    for row, configuration in enumerate(q):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        if not data.ncon:
            continue
        contact = data.contact
        bodies = model.geom_bodyid[contact.geom]
        for (first, second), distance in zip(bodies, contact.dist, strict=True):
            a, b = sorted((number[int(first)], number[int(second)]))
            near.add((a, b))
            if distance <= 0:
                overlaps.setdefault((a, b), np.zeros(len(q), dtype=bool))[row] = True
    return overlaps, near


def always_overlap(
    first_poses: Float[np.ndarray, "n 4 4"],
    first: Cover | None,
    second_poses: Float[np.ndarray, "n 4 4"],
    second: Cover | None,
) -> bool:
    """Returns whether the spheres of two links overlap in every configuration."""
    if first is None or second is None:
        return False
    for k in range(0, len(first_poses), _AT_ONCE):
        part = slice(k, k + _AT_ONCE)
        if (sphere_clearance(first_poses[part], first, second_poses[part], second) > 0).any():
            return False
    return True


def sphere_clearance(
    first_poses: Float[np.ndarray, "n 4 4"], first: Cover, second_poses: Float[np.ndarray, "n 4 4"], second: Cover
) -> Float[np.ndarray, "n"]:
    """Returns the least distance [m] between the spheres of two links, negative where they overlap."""
    poses = np.linalg.inv(second_poses) @ first_poses
    centers = first.centers @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
    _, away = core.deepest_balls(centers.reshape(-1, 3), second.centers, second.radii)
    return (away.reshape(len(poses), -1) - first.radii).min(axis=1)


def self_clearance(
    arm: ArmGeometry, covers: Sequence[Cover | None], pairs: Sequence[tuple[int, int]], q: Float[np.ndarray, "n dof"]
) -> Float[np.ndarray, "n"]:
    """Returns the least distance [m] between the spheres of the tested pairs in each configuration."""
    poses = arm.kinematics.link_poses(q)
    out = np.full(len(q), np.inf)
    for i, j in pairs:
        first, second = covers[i], covers[j]
        if first is None or second is None:
            continue
        out = np.minimum(out, sphere_clearance(poses[i], first, poses[j], second))
    return out


def tested_by_set(arm: ArmGeometry, pairs: SelfPairs) -> Mapping[str, list[tuple[int, int]]]:
    """Returns the pairs of link numbers that each sphere set tests."""
    out = {}
    for name in arm.covers:
        left_out = {frozenset(pair) for pair in pairs.of_set(name)}
        out[name] = [(i, j) for i, j in pairs.tested if frozenset((arm.links[i], arm.links[j])) not in left_out]
    return out
