"""Finds links that touch what their arm stands on in every configuration, which no planner could avoid."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.errors import MmpError
from mmp_env.importing.scene.arm_chain import PlacedArm
from mmp_env.importing.self_pairs import NEVER_M
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree

_SAMPLES = 10_000
"""Maximum number of sampled configurations."""
_STEADY_M = 0.002
"""Largest variation [m] of the depth of a contact that stands, such as that of a bearing on its pedestal."""


def contacts_to_allow(
    tree: ModelTree,
    arms: Sequence[PlacedArm],
    qpos: Float[np.ndarray, "nq"],
    obstacles: Sequence[int],
    collides: Bool[np.ndarray, "g g"],
) -> Mapping[int, frozenset[str]]:
    """Returns geom -> the links, such as `left/link1`, that may touch it.

    These are the links that the model lets overlap with the geom, and those that touch it equally deep in all of some
    random configurations.

    Args:
        tree: The model.
        arms: The arms.
        qpos: The configuration of the model, in which the other joints are held.
        obstacles: The geoms that no arm moves.
        collides: Which pairs of geoms collide.

    Raises:
        MmpError: if a link touches a geom in all of these configurations, but not equally deep.
    """
    out: dict[int, set[str]] = {geom: set() for geom in obstacles}
    link_of_geom: dict[int, str] = {}
    for placed in arms:
        for link in placed.chain.links[1:]:
            name = f"{placed.arm.name}/{link.name}"
            link_of_geom |= dict.fromkeys(link.geoms.tolist(), name)
            touching = np.asarray(collides[:, link.geoms].any(axis=1))
            for geom in obstacles:
                if not touching[geom]:
                    out[geom].add(name)
    for name, geom in _standing(tree, arms, qpos, link_of_geom):
        out[geom].add(name)
    return {geom: frozenset(names) for geom, names in out.items()}


def _standing(
    tree: ModelTree, arms: Sequence[PlacedArm], qpos: Float[np.ndarray, "nq"], link_of_geom: Mapping[int, str]
) -> set[tuple[str, int]]:
    """Returns pairs of a link and a geom of no arm that touch in all samples, equally deep. Raises `MmpError`."""
    always: set[tuple[str, int]] | None = None
    lowest: dict[tuple[int, int], float] = {}
    highest: dict[tuple[int, int], float] = {}
    for count, distances in enumerate(_sampled_distances(tree, arms, qpos, link_of_geom)):
        near = {(link_of_geom[geom], other) for geom, other in distances}
        always = near if always is None else always & near
        if not always:
            return set()
        for pair in lowest.keys() | distances.keys():
            distance = distances.get(pair, NEVER_M)
            lowest[pair] = min(distance, lowest.get(pair, NEVER_M))
            highest[pair] = max(distance, highest.get(pair, NEVER_M if count else distance))
    for geom, other in lowest:
        deepest, least = -lowest[geom, other], max(0.0, -highest[geom, other])
        if (link_of_geom[geom], other) in (always or ()) and highest[geom, other] + deepest > _STEADY_M:
            raise MmpError(
                f"link '{link_of_geom[geom]}' touches '{tree.geom_names[other]}' in every configuration, its geom"
                f" '{tree.geom_names[geom]}' by {1e3 * least:.0f} to {1e3 * deepest:.0f} mm; exclude the two in the"
                " model (<exclude>) if that is meant"
            )
    return always or set()


def _sampled_distances(
    tree: ModelTree, arms: Sequence[PlacedArm], qpos: Float[np.ndarray, "nq"], link_of_geom: Mapping[int, str]
) -> Iterator[dict[tuple[int, int], float]]:
    """Yields for each sample the geoms of links that are near geoms of no arm, with their signed distances [m]."""
    model = copy.copy(tree.model)
    model.geom_margin[:] = model.pair_margin[:] = NEVER_M
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.opt.disableflags &= ~sum(map(int, off))
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    data.qpos[:] = qpos
    joints = [joint for placed in arms for joint in placed.chain.joints]
    bounds = np.where(model.jnt_limited[joints, None], model.jnt_range[joints], [[-np.pi, np.pi]])
    for _ in range(_SAMPLES):
        data.qpos[model.jnt_qposadr[joints]] = random.uniform(bounds[:, 0], bounds[:, 1])
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        out: dict[tuple[int, int], float] = {}
        for (first, second), distance in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
            for geom, other in ((first, second), (second, first)):
                if geom in link_of_geom and other not in link_of_geom:
                    out[geom, other] = min(distance, out.get((geom, other), distance))
        yield out
