"""Describes an arm of a whole model link by link, as the importer of single robots does."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.importing.chain import Chain, arm_joint_names, at_zero, find_flange
from mmp_env.importing.chain_links import Link, distinct_names, link_of_bodies
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.kinematic_tree import pose_matrix
from mmp_env.importing.scene.model_arms import ModelArm
from mmp_env.sim.model_tree import ModelTree

BASE = "base"
"""Name of the link that carries the first joint. It has no geometry: what an arm stands on is an obstacle."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedArm:
    """An arm with its chain."""

    arm: ModelArm
    chain: Chain


def place_chain(
    tree: ModelTree, arm: ModelArm, qpos: Float[np.ndarray, "nq"], collides: Bool[np.ndarray, "g g"]
) -> PlacedArm:
    """Returns the chain of an arm in a model.

    Args:
        tree: The model.
        arm: The arm.
        qpos: Configuration of the model, in which the joints of no arm are held.
        collides: Which pairs of geoms collide.
    """
    model, data = tree.model, at_zero(tree.model, arm.joints, qpos)
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    solid[model.pair_geom1] = solid[model.pair_geom2] = True
    owner = tree.links_of(arm.joints)
    frames = [_joint_frame(model, data, joint) for joint in arm.joints]
    base = frames[0]
    names = _link_names(tree, arm)
    links = [_empty(BASE)]
    for k, frame in enumerate(frames, start=1):
        bodies = tuple(body for body, link in owner.items() if link == k)
        links.append(link_of_bodies(model, data, names[k], bodies, frame, np.linalg.inv(base) @ frame, solid))
    source = SourceModel(path=Path(_title(model)), title=_title(model), model=model)
    used = set(arm.joints)
    tip, site = find_flange(model, links[-1])
    flange = pose_matrix(data.xpos[tip], data.xmat[tip])
    if site is not None:
        flange = pose_matrix(data.site_xpos[site], data.site_xmat[site])
    chain = Chain(
        source=source,
        data=data,
        root=BASE,
        base=base,
        tip=tree.body_name(tip),
        joints=arm.joints,
        joint_names=tuple(arm_joint_names(model, arm.joints, arm.prefix)),
        links=tuple(links),
        held=tuple(tree.joint_name(j) for body in owner for j in tree.joints[body] if j not in used),
        flange=np.linalg.inv(frames[-1]) @ flange,
        apart=_apart(links, collides),
    )
    return PlacedArm(arm=arm, chain=chain)


def _joint_frame(model: Any, data: Any, joint: int) -> Float[np.ndarray, "4 4"]:
    return pose_matrix(data.xanchor[joint], data.xmat[int(model.jnt_bodyid[joint])])


def _link_names(tree: ModelTree, arm: ModelArm) -> list[str]:
    """Returns the names of the links without the prefix that all joints have, so equal arms have equal links."""
    raw = [BASE]
    for k, joint in enumerate(arm.joints):
        body = int(tree.model.jnt_bodyid[joint])
        shared = k + 1 < len(arm.joints) and int(tree.model.jnt_bodyid[arm.joints[k + 1]]) == body
        name = f"{tree.joint_name(joint)} link" if shared else tree.model.body(body).name
        raw.append(name.removeprefix(arm.prefix))
    return distinct_names(raw)


def _apart(links: list[Link], collides: Bool[np.ndarray, "g g"]) -> frozenset[tuple[int, int]]:
    """Returns the pairs of links of which the model lets no geoms touch."""
    return frozenset(
        (i, j)
        for i, j in combinations(range(len(links)), 2)
        if not collides[np.ix_(links[i].geoms, links[j].geoms)].any()
    )


def _empty(name: str) -> Link:
    nothing = np.zeros(3)
    return Link(
        name=name,
        bodies=(),
        frame=np.eye(4),
        geoms=np.empty(0, dtype=int),
        mass=0.0,
        center=nothing,
        inertia=np.zeros((3, 3)),
    )


def _title(model: Any) -> str:
    return model.names.split(b"\0", 1)[0].decode(errors="replace") or "model"
