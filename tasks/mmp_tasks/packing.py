"""Task `packing`: many arms over one box."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_tasks import grasping
from mmp_tasks.configuration_search import ConfigurationSearch, home
from mmp_tasks.draw_options import DrawOptions, draw_until_success
from mmp_tasks.table import Table

WALL_M, THICK_M = 0.05, 0.01
"""Height of the walls of the box, and thickness of walls and bottom."""
_SPACINGS_M = (0.15, 0.17, 0.19, 0.23, 0.25, 0.27)
"""Distances between neighbouring objects in the box; each draw takes the next one."""
_FEW_ARMS = 4
"""Largest number of arms that begin with the smallest spacing. More arms rarely fit there, and begin in the middle."""
_MIN_RADIUS_M = 0.10
"""Smallest distance from the middle of the box to an object."""
_SINGLE_ARM_REACH = 0.5
"""Distance from a single arm to its box, relative to the reach of the arm."""
_BORDER_M = 0.06
_CLEAR_M = 0.25
"""Height above the middle of the box that obstacles leave free, because tools come straight down."""
_RELEASE_HEIGHT_M = 0.03
"""Height of the objects above the bottom of the box in the goal."""


@dataclass(frozen=True, kw_only=True)
class Packing(DrawOptions):
    """From grasps into one box in the middle: all arms over it at once, each with an object in its tool.

    The box is made of obstacles named `box-...`. The objects end in a circle between its walls, each on its arm's side.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """Returns start, goal, and the cell with box and held objects. Raises `MmpError` if no draw succeeds."""
        return self.deliver(cell, rng).instance

    def deliver(self, cell: Cell, rng: np.random.Generator) -> grasping.Delivery:
        """Returns the same instance with the cells before and after it. Raises like `sample`."""
        grasping.require_empty_tools(cell)
        _require_room(cell)
        first = len(_SPACINGS_M) // 2 if len(cell.arms) > _FEW_ARMS else 0
        spacings = _SPACINGS_M[first:] + _SPACINGS_M[:first]
        search = ConfigurationSearch(cell=cell, options=self, rng=rng)
        return draw_until_success(self, cell, lambda number: _draw(search, spacings[number % len(spacings)]))


def _require_room(cell: Cell) -> None:
    """Raises `MmpError` if an arm cannot reach a box in the middle of the bases, or an obstacle stands there."""
    table = Table(cell)
    rule = "task 'packing' puts all objects into one box in the middle of the bases"
    allowed = "it needs a cell, such as a ring, in which every arm reaches a free middle"
    widest = _circle(_SPACINGS_M[-1], len(cell.arms))
    for arm in cell.arms:
        away = float(np.linalg.norm(table.center - arm.position[:2]))
        if away - widest > arm.robot.reach:
            raise MmpError(
                f"{rule}, which is {away:.2f} m from arm '{arm.name}' of cell '{cell.name}', beyond its reach of"
                f" {arm.robot.reach:.2f} m; {allowed}"
            )
    if (name := table.obstacle_at(_middle(cell, table), _CLEAR_M)) is not None:
        raise MmpError(f"{rule} of cell '{cell.name}', where obstacle '{name}' stands; {allowed}")


def _circle(spacing: float, count: int) -> float:
    """Returns the radius [m] of a circle of objects."""
    return max(spacing / (2 * np.sin(np.pi / count)), _MIN_RADIUS_M) if count > 1 else 0.0


def _draw(search: ConfigurationSearch, spacing: float) -> grasping.Delivery:
    cell = search.cell
    table = Table(cell)
    middle = _middle(cell, table)
    slots = _slots(search, table, middle, spacing)
    half = float(np.abs(np.array(list(slots.values())) - middle).max()) + _BORDER_M
    with_box = grasping.with_obstacles(cell, _box(middle, table.height, round(half, 3)))
    # The goal is drawn first, with placeholders in the tools, because it is harder to find than the grasps.
    loaded = replace(with_box, arms=tuple(grasping.holding_placeholder(arm) for arm in cell.arms))
    rise = table.height + THICK_M + _RELEASE_HEIGHT_M + grasping.OBJECT_M[2] + grasping.GAP_M
    targets = {arm.name: grasping.tip_target(arm, np.append(slots[arm.name], rise)) for arm in cell.arms}
    goal = search.within(loaded).find(targets, home(cell))
    grasps = grasping.draw_grasps(search.within(with_box), goal)
    rest = {name: np.append(slot, table.height + THICK_M) for name, slot in slots.items()}
    return grasping.make_delivery(search, grasps, goal, rest)


def _middle(cell: Cell, table: Table) -> Float[np.ndarray, " 2"]:
    """Returns the middle of the box [m]: the middle of the bases, or a point before a single arm."""
    arm, *others = cell.arms
    if others:
        return table.center
    return np.round(arm.position[:2] + _SINGLE_ARM_REACH * arm.robot.reach * table.forward(arm), 3)


def _slots(
    search: ConfigurationSearch, table: Table, middle: Float[np.ndarray, " 2"], spacing: float
) -> dict[str, Float[np.ndarray, " 2"]]:
    """Returns a point in the box for each arm, on the smallest circle, in the order of the arms around it."""
    arms = search.cell.arms
    count = len(arms)
    radius = _circle(spacing, count)
    inward = {arm.name: table.towards(arm, table.center) for arm in arms}
    angles = {name: float(np.arctan2(-forward[1], -forward[0])) for name, forward in inward.items()}
    order = sorted(angles, key=lambda name: angles[name])
    even = {name: 2 * np.pi * k / count for k, name in enumerate(order)}
    # The circle is turned so that each slot is in front of its arm, and by a small random angle.
    off = np.array([angles[name] - even[name] for name in order])
    turn = float(np.angle(np.exp(1j * off).sum())) + (2 * search.rng.random() - 1) * np.pi / (3 * count)
    return {
        arm.name: np.round(
            middle + radius * np.array([np.cos(even[arm.name] + turn), np.sin(even[arm.name] + turn)]), 4
        )
        for arm in arms
    }


def _box(middle: Float[np.ndarray, " 2"], z: float, half: float) -> list[Obstacle]:
    """Returns a bottom and four walls at the height `z` [m]; the walls are `half` [m] from the middle."""
    x, y = middle.tolist()
    out = [grasping.solid_box("box-bottom", np.array([x, y, z + THICK_M / 2]), (2 * half, 2 * half, THICK_M))]
    for name, side in (("east", (1, 0)), ("north", (0, 1)), ("west", (-1, 0)), ("south", (0, -1))):
        position = np.array([x + side[0] * half, y + side[1] * half, z + WALL_M / 2])
        size = (THICK_M if side[0] else 2 * half + THICK_M, THICK_M if side[1] else 2 * half + THICK_M, WALL_M)
        out.append(grasping.solid_box(f"box-{name}", position, size))
    return out
