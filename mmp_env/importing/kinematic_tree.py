"""The bodies of a compiled model as a tree, with the joints that an arm may have."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.mujoco_import import mujoco

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
"""MuJoCo's numbers of the joint types that an arm may have."""


class KinematicTree:
    """Bodies of a model as a tree, and the joints that an arm may have."""

    def __init__(self, source: SourceModel, prefix: str | None = None) -> None:
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
            is_kind = int(model.jnt_type[j]) in (HINGE, SLIDE)
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

    def body_or_site(self, name: str) -> tuple[int, int | None]:
        """The body of a name and None, or a site of that name after the body that carries it."""
        site = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, name)
        if site >= 0 and mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name) < 0:
            return int(self.model.site_bodyid[site]), site
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


def pose_matrix(position: Any, matrix: Any) -> Float[np.ndarray, "4 4"]:
    """Returns a pose of a position [3] and a rotation matrix of nine numbers."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = np.reshape(matrix, (3, 3)), position
    return out
