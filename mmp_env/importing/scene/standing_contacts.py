"""Finds links that touch what their arm stands on in every configuration, which no planner could avoid."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.importing.scene.arm_chain import PlacedArm
from mmp_env.importing.self_pairs import NEVER_M
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree

_SAMPLES = 200


def contacts_to_allow(
    tree: ModelTree,
    arms: Sequence[PlacedArm],
    qpos: Float[np.ndarray, "nq"],
    obstacles: Sequence[int],
    collides: Bool[np.ndarray, "g g"],
) -> Mapping[int, frozenset[str]]:
    """Returns geom -> the links, such as `left/link1`, that may touch it.

    These are the links that the model lets overlap with the geom, and those that come within 2 mm of it in all of some
    random configurations.

    Args:
        tree: The model.
        arms: The arms.
        qpos: The configuration of the model, in which the other joints are held.
        obstacles: The geoms that no arm moves.
        collides: Which pairs of geoms collide.
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
    for name, geom in _always_near(tree, arms, qpos, link_of_geom):
        out[geom].add(name)
    return {geom: frozenset(names) for geom, names in out.items()}


def _always_near(
    tree: ModelTree, arms: Sequence[PlacedArm], qpos: Float[np.ndarray, "nq"], link_of_geom: Mapping[int, str]
) -> set[tuple[str, int]]:
    """Returns pairs of a link and a geom of no arm that are near in all samples."""
    model = copy.copy(tree.model)
    model.geom_margin[:] = model.pair_margin[:] = NEVER_M
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    data.qpos[:] = qpos
    joints = [joint for placed in arms for joint in placed.chain.joints]
    bounds = np.where(model.jnt_limited[joints, None], model.jnt_range[joints], [[-np.pi, np.pi]])
    always: set[tuple[str, int]] | None = None
    for _ in range(_SAMPLES):
        data.qpos[model.jnt_qposadr[joints]] = random.uniform(bounds[:, 0], bounds[:, 1])
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        near = set()
        for first, second in data.contact.geom.tolist():
            for arm_geom, other in ((first, second), (second, first)):
                if arm_geom in link_of_geom and other not in link_of_geom:
                    near.add((link_of_geom[arm_geom], other))
        always = near if always is None else always & near
        if not always:
            break
    return always or set()
