"""Task `packing`: many arms over one box."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_tasks.grasping import (
    GAP_M,
    OBJECT_M,
    Delivery,
    GraspTask,
    holding_any,
    refuse_holding,
    solid_box,
    tip_place,
    with_obstacles,
)
from mmp_tasks.stances import home
from mmp_tasks.table import Table
from mmp_tasks.task import State

WALL_M, THICK_M = 0.05, 0.01
"""How high the box is, and how thick."""
_BETWEEN_M = (0.15, 0.17, 0.19, 0.23, 0.25, 0.27)
"""Between neighbouring objects over the box, in one draw after the other."""
_MANY = 4
"""More arms than these begin in the middle of that: closer they hardly ever fit."""
_LEAST_M = 0.10
"""From the middle of the box to an object."""
_ALONE = 0.5
"""The box of an arm alone is so many reaches before it."""
_BORDER_M = 0.06
_LOWERED_M = 0.03
"""So far above the bottom of the box the objects are at the end."""


@dataclass(frozen=True, kw_only=True)
class Packing(GraspTask):
    """From grasps into one box in the middle: all arms over it at once, each with an object in its tool.

    The box is made of obstacles named `box-...`. The objects end in a circle between its walls, each on its arm's side.
    """

    called: ClassVar[str] = "packing"

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """A start and a goal, and the cell with the box and what is held. Raises `MmpError` for no success."""
        drawn = self.deliver(cell, rng)
        return drawn.grasps, drawn.releases, drawn.during

    def deliver(self, cell: Cell, rng: np.random.Generator) -> Delivery:
        """The same, and what is before and after. Raises `MmpError` where no draw succeeds."""
        refuse_holding(cell)
        first = len(_BETWEEN_M) // 2 if len(cell.arms) > _MANY else 0
        widths = _BETWEEN_M[first:] + _BETWEEN_M[:first]
        return self.first(cell, lambda number: self._draw(cell, rng, widths[number % len(widths)]))

    def _draw(self, cell: Cell, rng: np.random.Generator, between: float) -> Delivery:
        table = Table(cell)
        middle = _middle(cell, table)
        slots = _slots(cell, table, middle, rng, between)
        half = float(np.abs(np.array(list(slots.values())) - middle).max()) + _BORDER_M
        room = with_obstacles(cell, _box(middle, table.height, round(half, 3)))
        # The end first, with any object in the tools, because it is the hardest to find.
        any_full = dataclasses.replace(room, arms=tuple(holding_any(arm) for arm in cell.arms))
        rise = table.height + THICK_M + _LOWERED_M + OBJECT_M[2] + GAP_M
        places = {arm.name: tip_place(arm, np.append(slots[arm.name], rise)) for arm in cell.arms}
        goal = self.stance(any_full, places, rng, home(cell))
        drawn = self.taken(room, rng, goal)
        rest = {name: np.append(slot, table.height + THICK_M) for name, slot in slots.items()}
        return self.delivery(drawn, (), rest, goal)


def _middle(cell: Cell, table: Table) -> Float[np.ndarray, " 2"]:
    """Where the box is: in the middle of the bases, and before an arm that is alone."""
    arm, *others = cell.arms
    if others:
        return table.center
    return np.round(arm.position[:2] + _ALONE * arm.robot.reach * table.forward(arm), 3)


def _slots(
    cell: Cell, table: Table, middle: Float[np.ndarray, " 2"], rng: np.random.Generator, between: float
) -> dict[str, Float[np.ndarray, " 2"]]:
    """A place in the box for each arm: on a circle just wide enough, in the order in which the arms stand around it."""
    count = len(cell.arms)
    radius = max(between / (2 * np.sin(np.pi / count)), _LEAST_M) if count > 1 else 0.0
    inward = {arm.name: table.forward(arm) for arm in cell.arms}
    angles = {name: float(np.arctan2(-way[1], -way[0])) for name, way in inward.items()}
    order = sorted(angles, key=lambda name: angles[name])
    even = {name: 2 * np.pi * k / count for k, name in enumerate(order)}
    # Turned as a whole so that each slot is before its arm as nearly as can be, and a little at random.
    off = np.array([angles[name] - even[name] for name in order])
    turn = float(np.angle(np.exp(1j * off).sum())) + (2 * rng.random() - 1) * np.pi / (3 * count)
    return {
        name: np.round(middle + radius * np.array([np.cos(even[name] + turn), np.sin(even[name] + turn)]), 4)
        for name in cell.arm_names
    }


def _box(middle: Float[np.ndarray, " 2"], z: float, half: float) -> list[Obstacle]:
    """A bottom and four walls, standing at the height `z` [m]; `half` [m] from the middle to a wall."""
    x, y = middle.tolist()
    out = [solid_box("box-bottom", np.array([x, y, z + THICK_M / 2]), (2 * half, 2 * half, THICK_M))]
    for name, way in (("east", (1, 0)), ("north", (0, 1)), ("west", (-1, 0)), ("south", (0, -1))):
        middle = np.array([x + way[0] * half, y + way[1] * half, z + WALL_M / 2])
        size = (THICK_M if way[0] else 2 * half + THICK_M, THICK_M if way[1] else 2 * half + THICK_M, WALL_M)
        out.append(solid_box(f"box-{name}", middle, size))
    return out
