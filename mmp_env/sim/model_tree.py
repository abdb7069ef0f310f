"""The bodies and joints of a compiled MuJoCo model as a tree."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from mmp_env.mujoco_import import mujoco

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class ModelTree:
    """The bodies of a model with their parents, children and joints, by their numbers in the model."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self.parents: list[int] = model.body_parentid.tolist()
        self.children: list[list[int]] = [[] for _ in self.parents]
        for body in range(1, model.nbody):
            self.children[self.parents[body]].append(body)
        self.joints: list[list[int]] = [[] for _ in self.parents]
        for joint, body in enumerate(model.jnt_bodyid.tolist()):
            self.joints[body].append(joint)

    def above(self, body: int) -> list[int]:
        """Returns all joints that move a body, the one nearest to the world first."""
        out: list[int] = []
        while body:
            out = self.joints[body] + out
            body = self.parents[body]
        return out

    def links_of(self, joints: Sequence[int]) -> dict[int, int]:
        """Returns body -> the link (from 1) that it belongs to in an arm of these joints."""
        own = {int(self.model.jnt_bodyid[joint]): k + 1 for k, joint in enumerate(joints)}
        out: dict[int, int] = {}
        for body in range(1, self.model.nbody):
            link = own.get(body, out.get(self.parents[body]))
            if link is not None:
                out[body] = link
        return out

    def joint_name(self, joint: int) -> str:
        """Returns the name of a joint, or `joint <number>` for one without a name."""
        return self.model.joint(joint).name or f"joint {joint}"

    def body_name(self, body: int) -> str:
        """Returns the name of a body, or `body <number>` for one without a name."""
        return self.model.body(body).name or f"body {body}"

    @cached_property
    def geom_names(self) -> list[str]:
        """Names of all geoms, distinct and without slashes. A geom without one is called after its body."""
        out: dict[str, None] = {}
        for geom, body in enumerate(self.model.geom_bodyid.tolist()):
            number = geom - int(self.model.body_geomadr[body])
            name = self.model.geom(geom).name or f"{self.body_name(body)} geom {number}"
            name = "".join(c if c.isprintable() and c != "/" else "_" for c in name)[:80]
            out[name if name not in out else f"{name} ({geom})"] = None
        return list(out)

    def geoms(self, body: int) -> range:
        """Returns the numbers of the geoms of a body."""
        first = int(self.model.body_geomadr[body])
        return range(first, first + int(self.model.body_geomnum[body]))

    def is_hinge_or_slide(self, joint: int) -> bool:
        """Returns whether a joint is one that an arm may have."""
        return int(self.model.jnt_type[joint]) in (HINGE, SLIDE)

    def chains(self, may_have: Callable[[int], bool]) -> list[list[int]]:
        """Returns the serial chains of joints that may belong to an arm, in the order of the model.

        Where a chain branches, it ends if it has more joints than each branch: these are fingers. Otherwise its joints
        are those of a torso and belong to no chain, and each branch begins chains of its own.
        """
        usable = [[j for j in joints if may_have(j)] for joints in self.joints]
        depth = [0] * len(self.parents)
        for body in range(len(self.parents) - 1, 0, -1):  # MuJoCo numbers parents first
            depth[body] += len(usable[body])
            depth[self.parents[body]] = max(depth[self.parents[body]], depth[body])

        def chains_from(body: int) -> list[list[int]]:
            done: list[int] = []
            while True:
                done += usable[body]
                branches = [child for child in self.children[body] if depth[child]]
                if not branches or (len(branches) > 1 and len(done) > max(depth[child] for child in branches)):
                    return [done] if done else []
                if len(branches) > 1:
                    return [chain for child in branches for chain in chains_from(child)]
                body = branches[0]

        return chains_from(0)
