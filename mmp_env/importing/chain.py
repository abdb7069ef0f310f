"""Describes an arm in a compiled model: its links, its joints' axes, its flange and the joints that are held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.importing.chain_choice import ChainChoice, ChainOptions, choose_chain
from mmp_env.importing.chain_links import Link, links_of
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.kinematic_tree import SLIDE, KinematicTree, pose_matrix
from mmp_env.mujoco_import import mujoco

FLANGE_NAMES = ("attachment_site", "flange", "tool0", "tcp", "ee_link", "end_effector", "right_hand", "left_hand")
"""Names of sites and bodies that are taken as the flange, the first that exists on the last link."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """The arm in a model. Link k + 1 is moved by joint k; `held` are the joints that stay at their value.

    `data` holds the model at q = 0 with the held joints at their values; `base` is T_world_root and `flange`
    T_lastlink_flange. `apart` are pairs of links that the model lets overlap. `notes` are sentences on its geometry.
    """

    source: SourceModel
    data: Any
    base: Float[np.ndarray, "4 4"]
    root: str
    tip: str
    joints: tuple[int, ...]
    joint_names: tuple[str, ...]
    links: tuple[Link, ...]
    held: tuple[str, ...]
    flange: Float[np.ndarray, "4 4"]
    apart: frozenset[tuple[int, int]] = frozenset()
    notes: tuple[str, ...] = ()

    @property
    def is_slide(self) -> list[bool]:
        return [int(self.source.model.jnt_type[j]) == SLIDE for j in self.joints]

    @property
    def axes(self) -> Float[np.ndarray, "dof 3"]:
        """Axes of the joints in the frames of their links."""
        axes = self.source.model.jnt_axis[list(self.joints)]
        return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def select_chain(source: SourceModel, options: ChainOptions) -> Chain:
    """Returns the arm that the options choose in a model. Raises `MmpError`, see `choose_chain`."""
    return describe_chain(source, choose_chain(source, options))


def describe_chain(source: SourceModel, choice: ChainChoice, qpos: Float[np.ndarray, "nq"] | None = None) -> Chain:
    """Returns the chosen arm of a model.

    Args:
        source: The model.
        choice: The arm's root, joints and tip.
        qpos: Values of the joints that are held; by default those of the model.
    """
    model = source.model
    data = at_zero(model, choice.joints, qpos)
    links = links_of(model, data, choice)
    tip, site = (choice.tip, choice.tip_site) if choice.tip is not None else find_flange(model, links[-1])
    pose = pose_matrix(data.xpos[tip], data.xmat[tip])
    if site is not None:
        pose = pose_matrix(data.site_xpos[site], data.site_xmat[site])
    base = pose_matrix(data.xpos[choice.root], data.xmat[choice.root])
    used = set(choice.joints)
    below = KinematicTree(source).below(choice.root)
    return Chain(
        source=source,
        data=data,
        base=base,
        root=model.body(choice.root).name,
        tip=model.body(tip).name if choice.tip is None or site is None else model.site(site).name,
        joints=choice.joints,
        joint_names=tuple(arm_joint_names(model, choice.joints, choice.prefix)),
        links=tuple(links),
        held=tuple(model.joint(j).name or f"joint {j}" for j in below if j not in used),
        flange=np.linalg.inv(base @ links[-1].frame) @ pose,
    )


def at_zero(model: Any, joints: Sequence[int], qpos: np.ndarray | None) -> Any:
    """Returns the state of a model with these joints at 0 and the others at their values in `qpos` or the model."""
    data = mujoco.MjData(model)
    if qpos is not None:
        data.qpos[:] = qpos
    for j in joints:
        data.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data


def arm_joint_names(model: Any, joints: Sequence[int], prefix: str) -> list[str]:
    """Returns distinct names of joints without slashes and without a prefix."""
    out: list[str] = []
    for k, j in enumerate(joints):
        name = model.joint(j).name.removeprefix(prefix) or f"joint{k + 1}"
        name = "".join(c if c.isprintable() and c != "/" else "_" for c in name)[:80]
        out.append(name if name not in out else f"{name}_{k + 1}")
    return out


def find_flange(model: Any, last: Link) -> tuple[int, int | None]:
    """Returns the site or body of a usual name on the last link, else the last of its bodies in a row.

    A site comes after the body that carries it; otherwise the second value is None.
    """
    sites = {model.site(s).name: s for s in range(model.nsite) if int(model.site_bodyid[s]) in last.bodies}
    bodies = {model.body(b).name: b for b in last.bodies}
    for wanted in FLANGE_NAMES:
        for name, site in sites.items():
            if name.endswith(wanted):
                return int(model.site_bodyid[site]), site
        for name, body in bodies.items():
            if name.endswith(wanted):
                return body, None
    body = last.bodies[0]
    while True:
        below = [b for b in last.bodies if int(model.body_parentid[b]) == body and not model.body_jntnum[b]]
        if len(below) != 1:
            return body, None
        body = below[0]
