"""Links of an arm in a compiled model: bodies that move as one, their frames, geoms and inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.importing.chain_choice import ChainChoice
from mmp_env.importing.kinematic_tree import pose_matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """Bodies that move as one. `frame` is T_root_link at q = 0; `geoms` are the ids of the collision geoms."""

    name: str
    bodies: tuple[int, ...]
    frame: Float[np.ndarray, "4 4"]
    geoms: Int[np.ndarray, " g"]
    mass: float
    center: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]


def links_of(model: Any, data: Any, choice: ChainChoice) -> list[Link]:
    """Returns the links from the base on; a body with several joints gives an empty link for each but the last.

    Args:
        model: The compiled model.
        data: Its state, which holds the arm at q = 0 and all other joints at their values.
        choice: The arm.
    """
    owner = _owners(model, choice)
    base = pose_matrix(data.xpos[choice.root], data.xmat[choice.root])
    inverse, solid = np.linalg.inv(base), colliding(model)
    out = []
    for k, name in enumerate(_link_names(model, choice.root, choice.joints)):
        if k == 0:
            frame = np.eye(4)
        else:
            j = choice.joints[k - 1]
            body = int(model.jnt_bodyid[j])
            frame = inverse @ pose_matrix(data.xanchor[j], data.xmat[body])
        bodies = tuple(b for b in range(1, model.nbody) if owner[b] == k)
        out.append(link_of_bodies(model, data, name, bodies, base @ frame, frame, solid))
    return out


def _owners(model: Any, choice: ChainChoice) -> list[int]:
    """The number of the link that each body belongs to, -1 for bodies of no link."""
    root, parents = choice.root, model.body_parentid
    owner = [-1] * model.nbody
    link_of_body = {}
    for k, j in enumerate(choice.joints):
        link_of_body[int(model.jnt_bodyid[j])] = k + 1  # the last joint of a body carries it
    owner[root] = 0
    for body in range(1, model.nbody):
        if body in choice.other_bodies:
            continue
        if body != root:
            above = owner[parents[body]] if not (root == 0 and parents[body] == 0) else 0
            owner[body] = link_of_body.get(body, above)
    if root == 0:  # what else stands in the world is no part of the arm
        for body in range(1, model.nbody):
            if owner[body] == 0:
                owner[body] = -1
    return owner


def colliding(model: Any) -> Bool[np.ndarray, "geoms"]:
    """Returns which geoms can touch anything: by their masks, or because a contact pair names them."""
    out = (np.asarray(model.geom_contype) | np.asarray(model.geom_conaffinity)) != 0
    out[model.pair_geom1], out[model.pair_geom2] = True, True
    return out


def link_of_bodies(
    model: Any, data: Any, name: str, bodies: tuple[int, ...], world: np.ndarray, frame: np.ndarray, solid: np.ndarray
) -> Link:
    """Returns a link with its frame in the world and in the root; `solid` tells which geoms collide."""
    geoms = np.flatnonzero(solid & np.isin(model.geom_bodyid, bodies))
    mass = float(sum(model.body_mass[b] for b in bodies))
    center = np.zeros(3)
    inertia = np.zeros((3, 3))
    if mass > 0:
        center = sum(model.body_mass[b] * data.xipos[b] for b in bodies) / mass
        for b in bodies:
            turn, away = data.ximat[b].reshape(3, 3), data.xipos[b] - center
            own = turn @ np.diag(model.body_inertia[b]) @ turn.T
            inertia += own + model.body_mass[b] * (away @ away * np.eye(3) - np.outer(away, away))
        center = world[:3, :3].T @ (center - world[:3, 3])
        inertia = world[:3, :3].T @ inertia @ world[:3, :3]
    return Link(name=name, bodies=bodies, frame=frame, geoms=geoms, mass=mass, center=center, inertia=inertia)


def _link_names(model: Any, root: int, joints: Sequence[int]) -> list[str]:
    raw = [model.body(root).name if root else "base"]
    for k, j in enumerate(joints):
        body = int(model.jnt_bodyid[j])
        shared = k + 1 < len(joints) and int(model.jnt_bodyid[joints[k + 1]]) == body
        raw.append(f"{model.joint(j).name}_link" if shared else model.body(body).name)
    return distinct_names(raw)


def distinct_names(raw: Sequence[str]) -> list[str]:
    """Returns names of links: distinct and without slashes."""
    out: list[str] = []
    for k, name in enumerate(raw):
        name = "".join(c if c.isprintable() and c != "/" else "_" for c in name)[:80] or f"link{k}"
        while name in out or name in ("held", "world"):
            name += "_"
        out.append(name)
    return out
