"""Grasps of objects on the table, and the delivery of the grasped objects.

A held object hangs on the axis of the tool, `GAP_M` before the tip. The gripper makes the last stroke, straight down to
the object and up with it; the stroke is no part of a plan. So a grasp is `ABOVE_M` above the object, and an arm that
holds the object has it at the tip.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.task import State
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_tasks.configuration_search import ConfigurationSearch, tucked
from mmp_tasks.draw_options import DrawFailed
from mmp_tasks.ik_candidates import ToolTarget
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.table import Sector, Table

OBJECT_M = (0.04, 0.04, 0.06)
"""Edges of an object."""
ABOVE_M = 0.05
"""Distance from the top of an object to the tip of the tool in a grasp."""
GAP_M = 0.005
"""Distance from the tip of the tool to the held object."""
_SPOTS = 10
"""Number of spots that are tried for one arm beside the arms before it."""
_DECIMALS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Grasps:
    """Grasps of all arms: in cell `empty` the objects are on the table, in cell `full` the arms hold them."""

    empty: Cell
    full: Cell
    grasps: State


@dataclass(frozen=True, kw_only=True, eq=False)
class Delivery:
    """Objects on the table in the cell `before`, in the tools in `during`, at rest in `after`.

    The arms hold them from the configurations `grasps` to `releases`.
    """

    before: Cell
    during: Cell
    after: Cell
    grasps: State
    releases: State

    @property
    def instance(self) -> tuple[State, State, Cell]:
        """Start, goal and cell of the motion with the objects in the tools."""
        return self.grasps, self.releases, self.during


@dataclass(frozen=True, kw_only=True, eq=False)
class _OverSpot:
    """A configuration [rad] with the tip of the tool over a spot on the table [m]."""

    spot: Float[np.ndarray, " 2"]
    q: Float[np.ndarray, " dof"]


def draw_grasps(search: ConfigurationSearch, near: State) -> Grasps:
    """Returns an object on the table for each arm, and a grasp close to `near`. Raises `DrawFailed`."""
    cell = search.cell
    table = Table(cell)
    spots, grasps = draw_spots(search, table, (OBJECT_M[2], OBJECT_M[2] + ABOVE_M), near)
    middle = table.height + OBJECT_M[2] / 2
    objects = {
        name: solid_box(f"object-{name}", np.append(spot, middle), OBJECT_M, search.rng.random())
        for name, spot in spots.items()
    }
    empty = with_obstacles(cell, objects.values())
    full = replace(cell, arms=tuple(_holding(arm, grasps[arm.name], objects[arm.name]) for arm in cell.arms))
    search.within(empty).require(grasps, "over its object")
    return Grasps(empty=empty, full=full, grasps=search.within(full).require(grasps, "with what it holds"))


def make_delivery(
    search: ConfigurationSearch,
    drawn: Grasps,
    releases: State,
    rest: Mapping[str, Float[np.ndarray, " 3"]],
    furniture: Sequence[Obstacle] = (),
) -> Delivery:
    """Returns the delivery of the grasped objects.

    Args:
        search: the clearances that the arms keep, tucked before and after, and at either end.
        drawn: the grasps.
        releases: the configurations in which the arms let the objects down.
        rest: arm name -> position of the underside of its object at rest [m].
        furniture: more obstacles, such as trays.

    Raises:
        DrawFailed: if an arm does not keep the clearances.
    """
    before, during = with_obstacles(drawn.empty, furniture), with_obstacles(drawn.full, furniture)
    half = np.array([0.0, 0.0, OBJECT_M[2] / 2])
    delivered = [solid_box(f"object-{name}", point + half, OBJECT_M) for name, point in rest.items()]
    bare = replace(during, arms=tuple(replace(arm, held=None) for arm in during.arms))
    after = with_obstacles(bare, delivered)
    for cell, state in ((before, drawn.grasps), (before, tucked(before)), (after, releases), (after, tucked(after))):
        search.within(cell).require(state, "beside what stands on the table")
    for state in (drawn.grasps, releases):
        search.within(during).require(state, "with what it holds")
    return Delivery(before=before, during=during, after=after, grasps=drawn.grasps, releases=releases)


def draw_spots(
    search: ConfigurationSearch,
    table: Table,
    heights: tuple[float, float],
    near: State,
    sectors: Sequence[Sector] = (Sector(),),
) -> tuple[dict[str, Float[np.ndarray, " 2"]], State]:
    """Returns a spot on the table for each arm, and configurations with the tips of the tools over the spots.

    Args:
        search: the cell in which the arms stand over their spots.
        table: the table with everything that stands on it.
        heights: height above the table [m] of the thing on a spot, and of the tip over it.
        near: preferred configurations.
        sectors: where the spots are; an arm tries the last sector first.

    Raises:
        DrawFailed: if an arm finds no spot.
    """
    thing, rise = heights

    def over_a_spot(arm: Arm, others: Mapping[str, _OverSpot]) -> _OverSpot:
        taken = [other.spot for other in others.values()]
        placed = {name: other.q for name, other in others.items()}
        for left in reversed(range(_SPOTS)):
            spot = table.free_spot(arm, search.rng, taken, thing, sectors[left * len(sectors) // _SPOTS])
            target = tip_target(arm, np.append(spot, table.height + rise))
            with contextlib.suppress(DrawFailed):
                return _OverSpot(spot=spot, q=search.find({arm.name: target}, near, placed)[arm.name])
        raise DrawFailed.at(arm)

    found = search.place_arms(over_a_spot)
    return {name: arm.spot for name, arm in found.items()}, {name: arm.q for name, arm in found.items()}


def require_empty_tools(cell: Cell) -> None:
    """Raises `MmpError` if an arm already holds something."""
    for arm in cell.arms:
        if arm.held is not None:
            raise MmpError(
                f"arm '{arm.name}' of cell '{cell.name}' holds '{arm.held.name}'; this task begins with empty tools"
            )


def tip(arm: Arm) -> float:
    """Returns how far the tool, or the last link without one, extends along the axis of the tool frame [m]."""
    last = len(arm.robot.link_names) - 1
    to_tool = np.linalg.inv(arm.robot.flange @ arm.tool.mount if arm.tool else arm.robot.flange)
    reach = 0.0
    for spheres in arm.robot.spheres.values():
        centers = spheres.centers[spheres.links == last] @ to_tool[:3, :3].T + to_tool[:3, 3]
        reach = max(reach, float((centers[:, 2] + spheres.radii[spheres.links == last]).max(initial=0.0)))
    for mine in arm.tool.spheres.values() if arm.tool else ():
        reach = max(reach, float((mine.centers[:, 2] + mine.radii).max(initial=0.0)))
    return reach


def tip_target(arm: Arm, point: Float[np.ndarray, "3"]) -> ToolTarget:
    """Returns the target of the tool point that brings the tip of an upright tool to `point` [m]."""
    beyond = tip(arm) - (arm.tool.point[2] if arm.tool else 0.0)
    return ToolTarget(point=point + np.array([0.0, 0.0, beyond]))


def solid_box(name: str, position: Float[np.ndarray, "3"], size: Sequence[float], yaw: float = 0.0) -> Obstacle:
    """Returns an upright box with its middle at `position` [m] and edges `size` [m], turned by `yaw` [rad]."""
    return Obstacle(
        name=name,
        shape="box",
        position=frozen_array(np.round(position, _DECIMALS)),
        quaternion=frozen_array(np.round(quaternion_from_yaw(yaw), _DECIMALS)),
        size=frozen_array(size),
    )


def with_obstacles(cell: Cell, more: Iterable[Obstacle]) -> Cell:
    """Returns the cell with more obstacles."""
    return replace(cell, obstacles=cell.obstacles + tuple(more))


def holding_placeholder(arm: Arm) -> Arm:
    """Returns the arm with an object of the usual size in its tool, in any orientation about the tool axis."""
    middle = np.array([0.0, 0.0, tip(arm) + GAP_M + OBJECT_M[2] / 2])
    return replace(arm, held=solid_box("object", middle, OBJECT_M))


def _holding(arm: Arm, q: Float[np.ndarray, " dof"], lying: Obstacle) -> Arm:
    """Returns the arm with the object at its tip, turned as the object lies on the table."""
    assert lying.size is not None
    T_world_tool = arm.T_world_base @ kinematics(arm.robot, arm.tool).tool_pose(q)
    # The object is straight below a tool that points straight down, within the tolerance of inverse kinematics.
    turned_by = np.arctan2(*(T_world_tool[:2, :2].T @ _x_axis(lying.quaternion))[::-1])
    middle = np.array([0.0, 0.0, tip(arm) + GAP_M + lying.size[2] / 2])
    return replace(arm, held=solid_box(lying.name, middle, lying.size.tolist(), turned_by))


def _x_axis(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, " 2"]:
    w, x, y, z = quaternion
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
