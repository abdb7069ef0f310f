"""Handling objects: what stands on the table, grasps above it, and the same arms holding what stood there.

An object hangs from the tool along the tool's axis, `GAP_M` before the tip. The last stroke, straight down to the
object and up with it, is the gripper's and no part of a plan: a grasp is `ABOVE_M` over the object, and whoever holds
it has it at the tip.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_tasks.drawing import DrawFailed
from mmp_tasks.ik_candidates import ToolTarget
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.stances import Posing, tucked
from mmp_tasks.table import Sector, Table
from mmp_tasks.task import State

OBJECT_M = (0.04, 0.04, 0.06)
"""Edges of an object."""
ABOVE_M = 0.05
"""From the top of an object to the tip of the tool that is about to take it."""
GAP_M = 0.005
_ROOM_M = 0.17
"""Between the middles of things on the table, so that two tools have room above them."""
_SPOTS = 10
"""So many are tried for an arm beside those before it."""
_DECIMALS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Handling:
    """Grasps of all arms: `empty` is the cell with the objects on the table, `full` the one in which arms hold them."""

    empty: Cell
    full: Cell
    grasps: State


@dataclass(frozen=True, kw_only=True, eq=False)
class Delivery:
    """What becomes of all objects: on the table in the cell `before`, in the tools in `during`, at rest in `after`.

    The arms hold them from the configurations `grasps` to `releases`.
    """

    before: Cell
    during: Cell
    after: Cell
    grasps: State
    releases: State


@dataclass(frozen=True, kw_only=True, eq=False)
class _OverSpot:
    """A configuration [rad] with the tip of the tool over a spot on the table [m]."""

    spot: Float[np.ndarray, " 2"]
    q: Float[np.ndarray, " dof"]


@runtime_checkable
class Deliverer(Protocol):
    """A task that brings objects somewhere."""

    def deliver(self, cell: Cell, rng: np.random.Generator) -> Delivery:
        """Draws once or more. Raises `MmpError` where no draw succeeds."""
        ...


@dataclass(frozen=True, kw_only=True)
class GraspTask(Posing):
    """A task in which every arm has an object of its own."""

    def taken(self, room: Cell, rng: np.random.Generator, near: State) -> Handling:
        """An object for each arm, somewhere on the table before it, and a grasp near to `near`. Raises `DrawFailed`."""
        table = Table(room)
        rise = OBJECT_M[2] + ABOVE_M
        spots, grasps = self.scattered(room, table, (OBJECT_M[2], rise), rng, near)
        objects = {
            name: solid_box(f"object-{name}", np.append(spot, table.height + OBJECT_M[2] / 2), OBJECT_M, rng.random())
            for name, spot in spots.items()
        }
        empty = with_obstacles(room, objects.values())
        full = dataclasses.replace(room, arms=tuple(_holding(a, grasps[a.name], objects[a.name]) for a in room.arms))
        self.require(empty, grasps, "over its object")
        return Handling(empty=empty, full=full, grasps=self.require(full, grasps, "with what it holds"))

    def delivery(
        self,
        drawn: Handling,
        furniture: Sequence[Obstacle],
        rest: Mapping[str, Float[np.ndarray, " 3"]],
        releases: State,
    ) -> Delivery:
        """The whole of it, with more `furniture`, and the undersides of objects coming to rest at `rest` [m].

        Raises `DrawFailed` where the arms are not clear, tucked before and after or at either end.
        """
        before, during = with_obstacles(drawn.empty, furniture), with_obstacles(drawn.full, furniture)
        half = np.array([0.0, 0.0, OBJECT_M[2] / 2])
        arrived = [solid_box(f"object-{name}", point + half, OBJECT_M) for name, point in rest.items()]
        bare = {name: dataclasses.replace(during.arm(name), held=None) for name in during.arm_names}
        after = with_obstacles(dataclasses.replace(during, arms=tuple(bare.values())), arrived)
        for cell, state in (
            (before, drawn.grasps),
            (before, tucked(before)),
            (after, releases),
            (after, tucked(after)),
        ):
            self.require(cell, state, "beside what stands on the table")
        for state in (drawn.grasps, releases):
            self.require(during, state, "with what it holds")
        return Delivery(before=before, during=during, after=after, grasps=drawn.grasps, releases=releases)

    def scattered(
        self,
        cell: Cell,
        table: Table,
        heights: tuple[float, float],
        rng: np.random.Generator,
        near: State,
        sectors: Sequence[Sector] = (Sector(),),
    ) -> tuple[dict[str, Float[np.ndarray, " 2"]], State]:
        """A spot on the table for each arm, and stances with the tips over them.

        An arm tries the last of `sectors` first. `heights` [m] over the table: of what is to stand there, and of the
        tips. Raises `DrawFailed`.
        """
        thing, rise = heights

        def over_a_spot(arm: Arm, others: Mapping[str, _OverSpot]) -> _OverSpot:
            taken = [other.spot for other in others.values()]
            beside = {name: other.q for name, other in others.items()}
            for left in reversed(range(_SPOTS)):
                spot = table.spot(arm, rng, taken, _ROOM_M, thing, sectors[left * len(sectors) // _SPOTS])
                place = tip_place(arm, np.append(spot, table.height + rise))
                with contextlib.suppress(DrawFailed):
                    return _OverSpot(spot=spot, q=self.stance(cell, {arm.name: place}, rng, near, beside)[arm.name])
            raise DrawFailed.at(arm)

        found = self.in_turn(cell, rng, over_a_spot)
        return {name: arm.spot for name, arm in found.items()}, {name: arm.q for name, arm in found.items()}


def refuse_holding(cell: Cell) -> None:
    """Raises `MmpError` where an arm holds something already."""
    for arm in cell.arms:
        if arm.held is not None:
            raise MmpError(
                f"arm '{arm.name}' of cell '{cell.name}' holds '{arm.held.name}'; this task begins with empty tools"
            )


def tip(arm: Arm) -> float:
    """How far the tool, or the last link without one, reaches along the axis of the tool frame [m]."""
    last = len(arm.robot.link_names) - 1
    to_tool = np.linalg.inv(arm.robot.flange @ arm.tool.mount if arm.tool else arm.robot.flange)
    reach = 0.0
    for key, spheres in arm.robot.spheres.items():
        centers = spheres.centers[spheres.links == last] @ to_tool[:3, :3].T + to_tool[:3, 3]
        reach = max(reach, float((centers[:, 2] + spheres.radii[spheres.links == last]).max(initial=0.0)))
        if arm.tool:
            mine = arm.tool.spheres[key]
            reach = max(reach, float((mine.centers[:, 2] + mine.radii).max(initial=0.0)))
    return reach


def tip_place(arm: Arm, point: Float[np.ndarray, "3"]) -> ToolTarget:
    """The place of the tool point with the tool straight down and its tip at `point` [m]."""
    beyond = tip(arm) - (arm.tool.point[2] if arm.tool else 0.0)
    return ToolTarget(point=point + np.array([0.0, 0.0, beyond]))


def solid_box(name: str, position: Float[np.ndarray, "3"], size: Sequence[float], yaw: float = 0.0) -> Obstacle:
    """An upright box, its middle at `position` [m]."""
    return Obstacle(
        name=name,
        shape="box",
        position=frozen_array(np.round(position, _DECIMALS)),
        quaternion=frozen_array(np.round(quaternion_from_yaw(yaw), _DECIMALS)),
        size=frozen_array(size),
    )


def with_obstacles(cell: Cell, more: Iterable[Obstacle]) -> Cell:
    """The cell with more in it."""
    return dataclasses.replace(cell, obstacles=cell.obstacles + tuple(more))


def holding_any(arm: Arm) -> Arm:
    """The arm with an object of the usual size, turned anyhow."""
    middle = np.array([0.0, 0.0, tip(arm) + GAP_M + OBJECT_M[2] / 2])
    return dataclasses.replace(arm, held=solid_box("object", middle, OBJECT_M))


def _holding(arm: Arm, q: Float[np.ndarray, " dof"], lying: Obstacle) -> Arm:
    """The arm with the object at its tip, turned as it is on the table."""
    assert lying.size is not None
    T_world_tool = arm.T_world_base @ kinematics(arm.robot, arm.tool).tool_pose(q)
    # Straight below a tool that points straight down, to within what inverse kinematics leaves.
    turned_by = np.arctan2(*(T_world_tool[:2, :2].T @ _x_axis(lying.quaternion))[::-1])
    middle = np.array([0.0, 0.0, tip(arm) + GAP_M + lying.size[2] / 2])
    held = solid_box("held", middle, lying.size.tolist(), turned_by)
    return dataclasses.replace(arm, held=dataclasses.replace(held, name=lying.name))


def _x_axis(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, " 2"]:
    w, x, y, z = quaternion
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
