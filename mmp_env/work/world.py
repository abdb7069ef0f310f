"""Where all objects are: in the tools of arms, or lying; and what may touch them there."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from mmp_env.errors import InvalidInstanceError
from mmp_env.ik.chain import chain_of
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.held import HELD, solid_hull
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import frozen_array
from mmp_env.model.transforms import quaternion_from_matrix
from mmp_env.work.resting import distance, overlap, supports, width_across

GRASP_TOLERANCE_M = 0.01
"""Largest distance of the tool point, or of the flange without a tool, from an object that is grasped [m]."""

Touching = frozenset[tuple[str, str]]
"""Parts of arms, such as `arm0/held`, with the solids that they may touch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class World(ReadOnly):
    """A cell and its objects.

    Attributes:
        cell: arms and obstacles without the objects.
        lying: object -> the solid where it lies.
        held: arm -> the object in its tool; its pose is in the frame of the tool, or of the flange without a tool.
        supports: object -> the solids that it lies on, or from which it was taken last.
        touching: what may touch.
    """

    cell: Cell
    lying: Mapping[str, Obstacle]
    held: Mapping[str, Obstacle] = field(default_factory=dict)
    supports: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    touching: Touching = frozenset()

    @cached_property
    def filled(self) -> Cell:
        """The cell with all objects: those that lie are obstacles."""
        if not (self.lying or self.held):
            return self.cell
        arms = tuple(_holding(arm, self.held.get(arm.name, arm.held)) for arm in self.cell.arms)
        touching: dict[str, set[str]] = {}
        empty = {f"{arm.name}/{HELD}" for arm in arms if arm.held is None}
        for part, solid in self.touching:
            if part in empty:  # it is allowed for an object that the arm does not hold yet, or no longer
                continue
            touching.setdefault(solid, set()).add(part)
        solids = (*self.cell.obstacles, *self.lying.values())
        free = tuple(
            replace(each, may_touch=each.may_touch | touching[each.name]) if each.name in touching else each
            for each in solids
        )
        return replace(self.cell, arms=arms, obstacles=free)

    def letting(self, touching: Iterable[tuple[str, str]]) -> World:
        """Returns the same world in which other things may touch."""
        wanted = frozenset(touching)
        return self if wanted == self.touching else replace(self, touching=wanted)

    def concerned(self, name: str) -> list[str]:
        """Returns an object, and the objects that it lies on, or from which it was taken last."""
        return [name, *(other for other in self.supports[name] if other in self.supports)]

    def holder(self, name: str) -> str | None:
        """Returns the arm that holds an object; None if it lies."""
        return next((arm for arm, held in self.held.items() if held.name == name), None)

    def grasped(self, arm: Arm, name: str, q: Float[np.ndarray, "dof"], where: str) -> World:
        """Returns the world after an arm has grasped an object.

        Raises:
            InvalidInstanceError: if the gripper is full, another arm holds the object, the tool is not at it, something
                stands on it, or it is too large.
        """
        if arm.name in self.held or arm.held is not None:
            held = self.held.get(arm.name, arm.held)
            assert held is not None
            raise InvalidInstanceError(
                f"{where} grasps '{name}', but the gripper of arm '{arm.name}' is full: it holds '{held.name}'"
            )
        if name not in self.lying:
            raise InvalidInstanceError(f"{where} grasps '{name}', which arm '{self.holder(name)}' holds")
        self.refuse_far(arm, name, q, where)
        if above := [other for other, under in self.supports.items() if name in under and other in self.lying]:
            raise InvalidInstanceError(f"{where} grasps '{name}' while '{above[0]}' stands on it")
        solid, grip = self.lying[name], grip_pose(arm, q)
        pose = np.linalg.inv(grip) @ solid.pose
        lying = {other: each for other, each in self.lying.items() if other != name}
        return replace(self, lying=lying, held=dict(self.held) | {arm.name: _placed(solid, pose)})

    def refuse_far(self, arm: Arm, name: str, q: Float[np.ndarray, "dof"], where: str) -> None:
        """Raises `InvalidInstanceError` if the tool is not at an object that lies, or cannot open so far."""
        solid, grip = self.lying[name], grip_pose(arm, q)
        gap_m = distance(solid, grip_point(arm, grip))
        if gap_m > GRASP_TOLERANCE_M:
            raise InvalidInstanceError(
                f"{where} grasps '{name}', which is out of reach: it is {gap_m:.3f} m from the tool of arm"
                f" '{arm.name}', and {GRASP_TOLERANCE_M:g} m is the most"
            )
        width = width_across(solid, grip[:3, 2])
        if arm.opening is not None and width > arm.opening:
            raise InvalidInstanceError(
                f"{where} grasps '{name}', which is {width:.3f} m wide between the fingers; the gripper of arm"
                f" '{arm.name}' opens {arm.opening:g} m"
            )

    def put(self, arm: Arm, name: str, q: Float[np.ndarray, "dof"], where: str) -> Obstacle:
        """Returns the object that an arm holds where it is in the world.

        Raises:
            InvalidInstanceError: if the arm does not hold the object.
        """
        held = self.held.get(arm.name)
        if held is None or held.name != name:
            instead = f"it holds '{held.name}'" if held is not None else "its gripper is empty"
            raise InvalidInstanceError(f"{where} releases '{name}', which arm '{arm.name}' does not hold; {instead}")
        pose = grip_pose(arm, q) @ held.pose
        return _placed(held, pose)

    def released(self, arm: Arm, name: str, q: Float[np.ndarray, "dof"], where: str) -> World:
        """Returns the world after an arm has released an object.

        Raises:
            InvalidInstanceError: if the arm does not hold the object, or it would fall.
        """
        solid = self.put(arm, name, q, where)
        found, why = self.under(solid)
        if not found:
            raise InvalidInstanceError(f"{where} releases '{name}' where it would not stay: {why}")
        held = {other: each for other, each in self.held.items() if other != arm.name}
        lying, under = dict(self.lying) | {name: solid}, dict(self.supports) | {name: tuple(found)}
        return replace(self, lying=lying, held=held, supports=under)

    def under(self, solid: Obstacle) -> tuple[list[str], str]:
        """Returns the solids that an object would rest on, and why it would not; see `supports`."""
        return supports(solid, [*self.cell.obstacles, *(s for s in self.lying.values() if s.name != solid.name)])


def first_world(cell: Cell, objects: Iterable[Obstacle]) -> World:
    """Returns the world at the begin of some work.

    Raises:
        InvalidInstanceError: for an object that nothing carries, or that is in another solid.
    """
    objects = tuple(objects)
    _refuse_overlaps(cell, objects)
    lying = {each.name: each for each in objects}
    world, under = World(cell=cell, lying=lying), {}
    for name, solid in lying.items():
        found, why = world.under(solid)
        if not found:
            raise InvalidInstanceError(f"object '{name}' does not stay where it is: {why}")
        under[name] = tuple(found)
    return replace(world, supports=under)


def _refuse_overlaps(cell: Cell, objects: Sequence[Obstacle]) -> None:
    for k, solid in enumerate(objects):
        for other in objects[:k]:
            if overlap(solid, other):
                raise InvalidInstanceError(f"objects '{other.name}' and '{solid.name}' overlap at the begin")
        for obstacle in cell.obstacles:
            if overlap(solid, obstacle):
                raise InvalidInstanceError(f"object '{solid.name}' is in obstacle '{obstacle.name}' at the begin")


def holding_parts(arm: Arm) -> list[str]:
    """Returns the parts of an arm that may touch an object that it grasps: its last link and its tool."""
    return [f"{arm.name}/{part}" for part in (arm.robot.link_names[-1], *([arm.tool.name] if arm.tool else []))]


def grasp_contacts(arm: Arm, name: str) -> Touching:
    """Returns what may touch in the motions before a grasp and after a release of an object."""
    return frozenset((part, name) for part in holding_parts(arm))


def support_contacts(arm: Arm, under: Iterable[str]) -> Touching:
    """Returns what may touch in the motions after a grasp and before a release of an object that solids carry."""
    return frozenset((f"{arm.name}/{HELD}", solid) for solid in under)


def grip_pose(arm: Arm, q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "4 4"]:
    """Returns the pose in the world of the frame of a tool, or of the flange without one."""
    return grip_poses(arm, np.asarray(q, dtype=float)[None])[0]


def grip_poses(arm: Arm, rows: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n 4 4"]:
    """Returns `grip_pose` of many configurations."""
    frames = chain_of(arm.robot, arm.tool).frames(np.asarray(rows, dtype=float))
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :3], out[:, :3, 3] = frames.rotation, frames.position
    return arm.T_world_base @ out


def lowest_points(held: Obstacle, poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n"]:
    """Returns the height of the lowest point of a held object at poses of the frame of the tool [m]."""
    vertices, radius = solid_hull(held)
    heights = poses[:, 2, :3] @ vertices.T + poses[:, 2, 3, None]
    return heights.min(axis=1) - radius


def grip_point(arm: Arm, grip: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "3"]:
    """Returns the tool point, or the origin of the flange, at a pose of the frame of the tool [m]."""
    return grip[:3, 3] + (grip[:3, :3] @ arm.tool.point if arm.tool else 0.0)


@functools.lru_cache(maxsize=1024)
def _holding(arm: Arm, held: Obstacle | None) -> Arm:
    """Returns an arm that holds something. The same arm and object give the same one, whose queries are made once."""
    return arm if held is arm.held else replace(arm, held=held)


def _placed(solid: Obstacle, pose: Float[np.ndarray, "4 4"]) -> Obstacle:
    return replace(
        solid,
        position=frozen_array(pose[:3, 3]),
        quaternion=frozen_array(quaternion_from_matrix(pose[:3, :3])),
    )
