"""An arm in the form of the native core: hinges and slides along the z axes of their frames, and spheres in frames.

Frame 0 is the world, in which the base stands. Frame k + 1 moves with joint k, whose axis is the z axis of the frame.
Each rigid part of the arm (link, tool, held object) moves with one frame.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.held import HELD, covering_spheres, solid_hull
from mmp_env.model.hulls import UNKNOWN_PROTRUSION_M
from mmp_env.model.robot import EXACT, Robot, Tool
from mmp_env.model.transforms import transform


def part_names(arm: Arm) -> tuple[str, ...]:
    """Returns the names of the rigid parts in the order of the core: links from the base on, tool, `held`."""
    return arm.robot.link_names + ((arm.tool.name,) if arm.tool else ()) + ((HELD,) if arm.held else ())


def untested_pairs(arm: Arm, sphere_set: str) -> set[frozenset[str]]:
    """Returns the names of parts that may overlap: those that the sphere set ignores, and a held object's holders."""
    links = arm.robot.link_names
    out = {frozenset((links[i], links[j])) for i, j in arm.robot.self_ignore[sphere_set]}
    if arm.tool is not None:
        touching = {*arm.tool.self_ignore[sphere_set], links[-1]}  # the last link carries the tool
        out |= {frozenset((link, arm.tool.name)) for link in touching}
    if arm.held is not None:
        holding = (links[-1], arm.tool.name) if arm.tool else links[-1:]
        out |= {frozenset((part, HELD)) for part in holding}
    return out


@dataclass(frozen=True, kw_only=True, eq=False)
class _Part:
    """Spheres of a part: centres in its frame and radii [m]."""

    frame: int
    spheres: Float[np.ndarray, "s 4"]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Moving:
    """The data of an arm that depend neither on its base nor on a held object.

    `joints[0]` is the pose of frame 1 in the base frame, `joints[k]` that of frame k + 1 in frame k, at q = 0. `parts`
    are all parts but the base. `T_last_grip` is the frame of a held object's pose, `T_last_tool` the frame with the
    tool point as its origin, both in the last frame.
    """

    joints: tuple[Float[np.ndarray, "4 4"], ...]
    parts: tuple[_Part, ...]
    T_last_grip: Float[np.ndarray, "4 4"]
    T_last_tool: Float[np.ndarray, "4 4"]


@functools.lru_cache(maxsize=256)
def joint_chain(arm: Arm, sphere_set: str) -> dict[str, np.ndarray]:
    """Returns the arguments of the core's `add_arm`."""
    robot = arm.robot
    moving = _moving(robot, arm.tool, sphere_set)
    base = robot.spheres[sphere_set]
    on_base = base.links == 0
    parts = [_part(0, arm.T_world_base, base.centers[on_base], base.radii[on_base]), *moving.parts]
    if arm.held is not None:
        parts.append(_part(robot.dof, moving.T_last_grip, *covering_spheres(arm.held)))
    joints = (arm.T_world_base @ moving.joints[0], *moving.joints[1:])
    return {
        "fixed": np.array([pose[:3].ravel() for pose in joints]),
        "tool": moving.T_last_tool[:3].ravel(),
        "slides": np.array(robot.slides),
        "lower": np.ascontiguousarray(robot.lower),
        "upper": np.ascontiguousarray(robot.upper),
        "link_frames": np.array([part.frame for part in parts], dtype=np.int32),
        "spheres": np.concatenate([part.spheres for part in parts]),
        "sphere_links": np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.spheres) for part in parts]),
        "self_pairs": _tested_pairs(arm, sphere_set),
    }


def exact_hulls(arm: Arm) -> list[dict[str, Any]]:
    """Returns the arguments of the core's `add_hull`, but the number of the arm, for each hull of the arm."""
    robot, tool = arm.robot, arm.tool
    moving = _moving(robot, tool, EXACT)
    poses = [arm.T_world_base, *(np.linalg.inv(_z_to(axis)) for axis in robot.axes)]
    out = [_hull(hull.link, poses[hull.link], hull.vertices, hull.radius, robot.protrusion) for hull in robot.hulls]
    part = robot.dof + 1
    if tool is not None:
        out += [_hull(part, moving.T_last_grip, hull.vertices, hull.radius, tool.protrusion) for hull in tool.hulls]
        part += 1
    if arm.held is not None:
        out.append(_hull(part, moving.T_last_grip, *solid_hull(arm.held), UNKNOWN_PROTRUSION_M))
    return out


def _hull(link: int, pose: np.ndarray, vertices: np.ndarray, radius: float, protrusion: float) -> dict[str, Any]:
    """Returns arguments of `add_hull`. `pose` is that of the vertices in the frame of the part."""
    placed = np.array([pose[:3, :3] @ vertex + pose[:3, 3] for vertex in vertices])
    return {"link": link, "vertices": placed, "radius": radius, "protrusion": protrusion}


@functools.lru_cache(maxsize=64)
def _moving(robot: Robot, tool: Tool | None, sphere_set: str) -> _Moving:
    align = [_z_to(axis) for axis in robot.axes]
    back = [np.linalg.inv(pose) for pose in align]
    joints = [robot.origins[0] @ align[0]]
    joints += [back[k - 1] @ robot.origins[k] @ align[k] for k in range(1, robot.dof)]
    spheres = robot.spheres[sphere_set]
    parts = [
        _part(link, back[link - 1], spheres.centers[spheres.links == link], spheres.radii[spheres.links == link])
        for link in range(1, robot.dof + 1)
    ]
    grip = point = robot.flange
    if tool is not None:
        grip = robot.flange @ tool.mount
        point = grip @ transform(np.eye(3), tool.point)
        mine = tool.spheres[sphere_set]
        parts.append(_part(robot.dof, back[-1] @ grip, mine.centers, mine.radii))
    return _Moving(joints=tuple(joints), parts=tuple(parts), T_last_grip=back[-1] @ grip, T_last_tool=back[-1] @ point)


def _part(
    frame: int, pose: Float[np.ndarray, "4 4"], centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
) -> _Part:
    """Returns a part of spheres whose centres are given at a pose in its frame."""
    placed = np.array([pose[:3, :3] @ center + pose[:3, 3] for center in centers]).reshape(-1, 3)
    return _Part(frame=frame, spheres=np.column_stack([placed, radii]))


def _tested_pairs(arm: Arm, sphere_set: str) -> np.ndarray:
    """Returns pairs of part numbers [p, 2] that must not touch, the lower number first."""
    untested = untested_pairs(arm, sphere_set)
    numbered = combinations(enumerate(part_names(arm)), 2)
    pairs = [(i, j) for (i, first), (j, second) in numbered if frozenset((first, second)) not in untested]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def _z_to(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4 4"]:
    """Returns a rotation that takes z to `axis`; the identity if it is z already."""
    a = axis / np.linalg.norm(axis)
    z = np.array([0.0, 0.0, 1.0])
    v, c = np.cross(z, a), float(z @ a)
    if c < -1 + 1e-12:
        return transform(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return transform(np.eye(3) + skew + skew @ skew / (1 + c), np.zeros(3))
