"""Selects the serial chain of a model that is the arm, and describes it link by link."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.importing.source import SourceModel
from mmp_env.mujoco_import import mujoco

FLANGE_NAMES = ("attachment_site", "flange", "tool0", "tcp", "ee_link", "end_effector", "right_hand", "left_hand")
"""Names of sites and bodies that are taken as the flange, the first that exists on the last link."""
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainOptions:
    """Options of the choice, by names in the model: where the chain begins and ends, and which joints it may have."""

    root: str | None = None
    tip: str | None = None
    tool: str | None = None
    prefix: str | None = None


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """The arm in a model. Link k + 1 is moved by joint k; `held` are the joints that stay at their value.

    `data` holds the model at q = 0 with the held joints at their values; `flange` is T_lastlink_flange.
    """

    source: SourceModel
    data: Any
    root: str
    tip: str
    joints: tuple[int, ...]
    joint_names: tuple[str, ...]
    links: tuple[Link, ...]
    held: tuple[str, ...]
    flange: Float[np.ndarray, "4 4"]

    @property
    def is_slide(self) -> list[bool]:
        return [int(self.source.model.jnt_type[j]) == _SLIDE for j in self.joints]

    @property
    def axes(self) -> Float[np.ndarray, "dof 3"]:
        """Axes of the joints in the frames of their links."""
        axes = self.source.model.jnt_axis[list(self.joints)]
        return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def select_chain(source: SourceModel, options: ChainOptions) -> Chain:
    """Returns the chain of hinge and slide joints from the root to the tip, the longest without these options.

    Raises:
        MmpError: if there is no joint, if a name is unknown, or if the chain holds what an arm cannot have.
    """
    tree = _Tree(source, options.prefix)
    root = tree.body(options.root, "--root") if options.root else None
    tip_pose = None
    if options.tip:
        tip, tip_pose = tree.body_or_site(options.tip)
    else:
        tip = tree.longest_tip(root)
    joints = tree.joints_between(root, tip)
    if not joints:
        where = f" between '{options.root or 'world'}' and '{options.tip}'" if options.tip else ""
        raise MmpError(f"{source.path} has no hinge or slide joint{where}; an arm needs at least one")
    _refuse_odd_joints(source, joints)
    _refuse_loops(source, tree, joints)
    if root is None:
        root = tree.first_ancestor(int(source.model.jnt_bodyid[joints[0]]))
    data = _at_zero(source.model, joints)
    links = _links(source.model, data, root, joints, tree)
    if options.tool:
        tip, tip_pose = tree.body(options.tool, "--tool"), None
        if tip not in links[-1].bodies:
            raise MmpError(f"--tool {options.tool} does not hang on the last link; its joints are not the arm's")
    elif not options.tip:
        tip, tip_pose = _flange(source.model, links[-1])
    pose = _pose(data.xpos[tip], data.xmat[tip]) if tip_pose is None else tip_pose(data)
    used = set(joints)
    return Chain(
        source=source,
        data=data,
        root=source.model.body(root).name,
        tip=options.tip or options.tool or source.model.body(tip).name,
        joints=tuple(joints),
        joint_names=tuple(_joint_names(source.model, joints, options.prefix)),
        links=tuple(links),
        held=tuple(source.model.joint(j).name or f"joint {j}" for j in tree.below(root) if j not in used),
        flange=np.linalg.inv(_pose(data.xpos[root], data.xmat[root]) @ links[-1].frame) @ pose,
    )


class _Tree:
    """Bodies and joints of a model as a tree."""

    def __init__(self, source: SourceModel, prefix: str | None) -> None:
        self.source, self.model, self._prefix = source, source.model, prefix
        model = source.model
        self.parents = [int(p) for p in model.body_parentid]
        self.children: list[list[int]] = [[] for _ in self.parents]
        for body in range(1, model.nbody):
            self.children[self.parents[body]].append(body)
        coupled = set(source.mimics) | _coupled(model)
        self._usable: list[list[int]] = [[] for _ in self.parents]
        for j in range(model.njnt):
            name = model.joint(j).name
            is_kind = int(model.jnt_type[j]) in (_HINGE, _SLIDE)
            if is_kind and name not in coupled and name.startswith(prefix or ""):
                self._usable[int(model.jnt_bodyid[j])].append(j)
        if prefix and not any(self._usable):
            names = [model.joint(j).name for j in range(model.njnt)]
            raise UnknownNameError("joint prefix", prefix, names)

    def body(self, name: str, option: str) -> int:
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
        if found < 0:
            names = [self.model.body(b).name for b in range(self.model.nbody)]
            raise UnknownNameError(f"body of {option}", name, names)
        return found

    def body_or_site(self, name: str) -> tuple[int, Any]:
        """A body and a function that returns the pose of the tip, None for the body's own."""
        site = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, name)
        if site >= 0 and mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name) < 0:
            return int(self.model.site_bodyid[site]), lambda data: _pose(data.site_xpos[site], data.site_xmat[site])
        return self.body(name, "--tip"), None

    def joints_between(self, root: int | None, tip: int) -> list[int]:
        """The joints that move `tip` against `root`, from the root on."""
        out, body = [], tip
        while body != 0 and body != root:
            out = self._usable[body] + out
            body = self.parents[body]
        if root not in (None, body):
            raise MmpError(f"'{self.model.body(tip).name}' does not hang on '{self.model.body(root).name}'")
        return out

    def longest_tip(self, root: int | None) -> int:
        """The body at the end of the longest chain, without the fingers.

        The chain ends at the body where two or more branches with joints begin, if each is shorter than the chain.
        """
        depth = [0] * len(self.parents)
        for body in range(len(self.parents) - 1, 0, -1):  # MuJoCo numbers parents first
            depth[body] += len(self._usable[body])
            depth[self.parents[body]] = max(depth[self.parents[body]], depth[body])
        body, done, last = root or 0, 0, root or 0
        while True:
            branches = [child for child in self.children[body] if self._moves(child)]
            if not branches:
                return last
            longest = max(branches, key=lambda child: depth[child])
            if depth[longest] == 0 or (len(branches) > 1 and done > depth[longest]):
                return last
            body = longest
            done += len(self._usable[body])
            if self._usable[body]:
                last = body

    def first_ancestor(self, body: int) -> int:
        """The outermost body above the first joint; the world where there is none."""
        chain = [body]
        while self.parents[chain[-1]] != 0:
            chain.append(self.parents[chain[-1]])
        return chain[-1] if len(chain) > 1 else 0

    def below(self, body: int) -> list[int]:
        """All joints of the bodies that hang on `body`, of any type."""
        out, stack = [], list(self.children[body])
        while stack:
            b = stack.pop()
            out += range(
                int(self.model.body_jntadr[b]), int(self.model.body_jntadr[b]) + int(self.model.body_jntnum[b])
            )
            stack += self.children[b]
        return sorted(out)

    def _moves(self, body: int) -> bool:
        return bool(self.model.body_jntnum[body]) or any(self._moves(child) for child in self.children[body])


def _coupled(model: Any) -> set[str]:
    """Joints that equality constraints make follow another joint, as mimic joints of a gripper do."""
    out = set()
    for k in range(model.neq):
        if int(model.eq_type[k]) == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_obj2id[k] >= 0:
            out.add(model.joint(int(model.eq_obj1id[k])).name)
    return out


def _refuse_odd_joints(source: SourceModel, joints: Sequence[int]) -> None:
    model = source.model
    for j in joints:
        name, kind = model.joint(j).name, int(model.jnt_type[j])
        if kind == _SLIDE and not model.jnt_limited[j]:
            raise MmpError(f"{source.path}: slide joint '{name}' has no limits; give it a range")
        if model.jnt_limited[j] and not model.jnt_range[j, 0] < model.jnt_range[j, 1]:
            raise MmpError(f"{source.path}: joint '{name}' has an empty range; give it lower and upper limits")
        body = int(model.jnt_bodyid[j])
        others = range(int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body]))
        if any(int(model.jnt_type[o]) not in (_HINGE, _SLIDE) for o in others):
            raise MmpError(f"{source.path}: body '{model.body(body).name}' has a ball or free joint beside '{name}'")
    first, last = int(model.jnt_bodyid[joints[0]]), int(model.jnt_bodyid[joints[-1]])
    while last != first:
        for o in range(int(model.body_jntadr[last]), int(model.body_jntadr[last]) + int(model.body_jntnum[last])):
            if int(model.jnt_type[o]) not in (_HINGE, _SLIDE):
                raise MmpError(
                    f"{source.path}: joint '{model.joint(o).name}' in the chain is a ball joint; an arm has hinge and"
                    " slide joints"
                )
        last = int(model.body_parentid[last])


def _refuse_loops(source: SourceModel, tree: _Tree, joints: Sequence[int]) -> None:
    """Raises `MmpError` where a constraint closes a loop over a joint of the chain."""
    model, used = source.model, set(joints)

    def moved(body: int) -> set[int]:
        return set(tree.joints_between(None, body)) & used

    for k in range(model.neq):
        kind, first, second = int(model.eq_type[k]), int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        name = model.eq(k).name or f"number {k}"
        if kind in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
            is_site = int(model.eq_objtype[k]) == int(mujoco.mjtObj.mjOBJ_SITE)
            a, b = (int(model.site_bodyid[i]) if is_site else i for i in (first, second))
            if moved(a) != moved(b):
                raise MmpError(
                    f"{source.path} has a closed loop: equality constraint {name} joins '{model.body(a).name}' and"
                    f" '{model.body(b).name}'; an arm must be a serial chain"
                )
        elif kind == int(mujoco.mjtEq.mjEQ_JOINT) and {first, second} & used and second >= 0:
            raise MmpError(
                f"{source.path}: equality constraint {name} makes joint '{model.joint(first).name}' follow"
                f" '{model.joint(second).name}'; the joints of an arm must move independently"
            )
    names = {model.joint(joint).name for joint in joints}
    for follower, leader in source.mimics.items():
        if leader in names or follower in names:
            raise MmpError(
                f"{source.path}: joint '{follower}' mimics '{leader}'; the joints of an arm must move independently"
            )


def _at_zero(model: Any, joints: Sequence[int]) -> Any:
    data = mujoco.MjData(model)
    for j in joints:
        data.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data


def _links(model: Any, data: Any, root: int, joints: Sequence[int], tree: _Tree) -> list[Link]:
    """The links from the base on; a body with several joints gives a link of no geometry for each but the last."""
    owner = [-1] * model.nbody
    link_of_body = {}
    for k, j in enumerate(joints):
        link_of_body[int(model.jnt_bodyid[j])] = k + 1  # the last joint of a body carries it
    owner[root] = 0
    for body in range(1, model.nbody):
        if body != root:
            above = owner[tree.parents[body]] if not (root == 0 and tree.parents[body] == 0) else 0
            owner[body] = link_of_body.get(body, above)
    if root == 0:  # what else stands in the world is no part of the arm
        for body in range(1, model.nbody):
            if owner[body] == 0:
                owner[body] = -1
    base = _pose(data.xpos[root], data.xmat[root])
    inverse, names = np.linalg.inv(base), _link_names(model, root, joints)
    out = []
    for k, name in enumerate(names):
        if k == 0:
            frame = np.eye(4)
        else:
            j = joints[k - 1]
            body = int(model.jnt_bodyid[j])
            frame = inverse @ _pose(data.xanchor[j], data.xmat[body])
        bodies = tuple(b for b in range(model.nbody) if owner[b] == k and (b != 0 or root != 0))
        out.append(_link(model, data, name, bodies, base @ frame, frame))
    return out


def _link(model: Any, data: Any, name: str, bodies: tuple[int, ...], world: np.ndarray, frame: np.ndarray) -> Link:
    geoms = np.array([g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies], dtype=int)
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
    """Distinct names without slashes."""
    raw = [model.body(root).name if root else "base"]
    for k, j in enumerate(joints):
        body = int(model.jnt_bodyid[j])
        shared = k + 1 < len(joints) and int(model.jnt_bodyid[joints[k + 1]]) == body
        raw.append(f"{model.joint(j).name}_link" if shared else model.body(body).name)
    out: list[str] = []
    for k, name in enumerate(raw):
        name = "".join(c if c.isprintable() and c != "/" else "_" for c in name)[:80] or f"link{k}"
        while name in out or name in ("held", "world"):
            name += "_"
        out.append(name)
    return out


def _joint_names(model: Any, joints: Sequence[int], prefix: str | None) -> list[str]:
    out: list[str] = []
    for k, j in enumerate(joints):
        name = model.joint(j).name.removeprefix(prefix or "") or f"joint{k + 1}"
        name = "".join(c if c.isprintable() and c != "/" else "_" for c in name)[:80]
        out.append(name if name not in out else f"{name}_{k + 1}")
    return out


def _flange(model: Any, last: Link) -> tuple[int, Any]:
    """The site or body of a usual name on the last link, else the last of its bodies that hang on each other."""
    sites = {model.site(s).name: s for s in range(model.nsite) if int(model.site_bodyid[s]) in last.bodies}
    bodies = {model.body(b).name: b for b in last.bodies}
    for wanted in FLANGE_NAMES:
        for name, site in sites.items():
            if name.endswith(wanted):
                return int(model.site_bodyid[site]), lambda data, s=site: _pose(data.site_xpos[s], data.site_xmat[s])
        for name, body in bodies.items():
            if name.endswith(wanted):
                return body, None
    body = last.bodies[0]
    while True:
        below = [b for b in last.bodies if int(model.body_parentid[b]) == body and not model.body_jntnum[b]]
        if len(below) != 1:
            return body, None
        body = below[0]


def _pose(position: Any, matrix: Any) -> Float[np.ndarray, "4 4"]:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = np.reshape(matrix, (3, 3)), position
    return out


def joint_values(chain: Chain, values: Mapping[str, float]) -> Float[np.ndarray, "dof"]:
    """Returns values by joint name in the order of the chain."""
    return np.array([values[name] for name in chain.joint_names])
