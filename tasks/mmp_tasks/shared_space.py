"""The spaces that arms share: one in the middle of a cell, or one of each arm and its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.transforms import matrix_from_quaternion

INSET_M = 0.15
"""Distance between the shared space and the ring of bases."""
MIN_RADIUS_M = 0.20
"""Smallest radius of the shared space. A ring of two short arms, 0.29 m wide, would otherwise leave 0.14 m."""
LOWEST_M, HIGHEST_M = 0.05, 0.80
"""Height of the shared space above the lowest base, which is assumed to stand on the table."""
_NEIGHBOURS, _REACHED = 2, 0.75
"""Number of other arms that reach a point of an arm's space, and the share of their reach, along the table."""


@runtime_checkable
class Space(Protocol):
    """A part of the world for tool points."""

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Returns which points of the world are in the space or on its surface."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Middle:
    """The space in the middle of a cell: an upright cylinder.

    Attributes:
        center: of the cylinder [2] [m].
        radius: of the cylinder [m].
        bottom: lower end [m].
        top: upper end [m].
    """

    center: Float[np.ndarray, " 2"]
    radius: float
    bottom: float
    top: float

    def __str__(self) -> str:
        x, y = self.center
        return f"within {self.radius:.2f} m of ({x:.2f}, {y:.2f}) at a height of {self.bottom:.2f} to {self.top:.2f} m"

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Returns which points of the world are in the space or on its surface."""
        aside = points[:, :2] - self.center
        beside = aside[:, 0] ** 2 + aside[:, 1] ** 2 <= self.radius**2
        return beside & (points[:, 2] >= self.bottom) & (points[:, 2] <= self.top)


@dataclass(frozen=True, kw_only=True, eq=False)
class Neighbourhood:
    """The space that an arm shares with its neighbours: points that enough other arms reach as well.

    Attributes:
        centers: bases of the neighbours [n, 2] [m].
        radii: how far the neighbours reach along the table [n] [m].
        least: number of neighbours that reach a point.
        bottom: lower end [m].
        top: upper end [m].
    """

    centers: Float[np.ndarray, "n 2"]
    radii: Float[np.ndarray, " n"]
    least: int
    bottom: float
    top: float

    def __str__(self) -> str:
        others = {0: "", 1: "that another arm reaches ", 2: "that two other arms reach "}[self.least]
        return f"{others}at a height of {self.bottom:.2f} to {self.top:.2f} m"

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Returns which points of the world are in the space or on its surface."""
        aside = points[:, None, :2] - self.centers
        reached = (aside[..., 0] ** 2 + aside[..., 1] ** 2 <= self.radii**2).sum(axis=1)
        return (reached >= self.least) & (points[:, 2] >= self.bottom) & (points[:, 2] <= self.top)


def has_open_middle(cell: Cell) -> bool:
    """Returns whether all arms stand around the middle of a cell and reach its axis, on which no obstacle stands."""
    space = middle(cell)
    if len(cell.arms) == 1:
        return True
    bases = np.array([arm.position[:2] for arm in cell.arms])
    away = np.linalg.norm(bases - space.center, axis=1)
    around = bool((away >= space.radius).all())
    near = bool((away < [arm.robot.reach for arm in cell.arms]).all())
    return around and near and not any(_stands_on_axis(space, solid) for solid in cell.obstacles)


def middle(cell: Cell) -> Middle:
    """Returns the space in the middle of a cell.

    Its centre is the mean of the bases. Its radius is their mean horizontal distance from the centre less `INSET_M`,
    and at least `MIN_RADIUS_M`. A single arm has a radius of its whole reach.
    """
    bases = np.array([arm.position for arm in cell.arms])
    center = bases[:, :2].mean(axis=0)
    if len(cell.arms) == 1:
        radius = cell.arms[0].robot.reach
    else:
        ring_radius = float(np.linalg.norm(bases[:, :2] - center, axis=1).mean())
        radius = max(ring_radius - INSET_M, MIN_RADIUS_M)
    bottom, top = _heights(cell.arms)
    return Middle(center=center, radius=radius, bottom=bottom, top=top)


def neighbours(cell: Cell, arm: Arm) -> list[Arm]:
    """Returns the other arms whose reach overlaps that of an arm, the nearest first."""
    apart = {
        other.name: float(np.linalg.norm(other.position - arm.position)) for other in cell.arms if other is not arm
    }
    close = [
        other for other in cell.arms if other is not arm and apart[other.name] < arm.robot.reach + other.robot.reach
    ]
    return sorted(close, key=lambda other: apart[other.name])


def neighbourhood(cell: Cell, arm: Arm) -> Neighbourhood:
    """Returns the space that an arm shares with its neighbours."""
    others = neighbours(cell, arm)
    bottom, top = _heights([arm, *others])
    return Neighbourhood(
        centers=np.array([other.position[:2] for other in others]).reshape(-1, 2),
        radii=np.array([_REACHED * other.robot.reach for other in others]),
        least=min(_NEIGHBOURS, len(others)),
        bottom=bottom,
        top=top,
    )


def _heights(arms: Sequence[Arm]) -> tuple[float, float]:
    table = min(float(arm.position[2]) - arm.robot.ring_height for arm in arms)
    return table + LOWEST_M, table + HIGHEST_M


def _stands_on_axis(space: Middle, solid: Obstacle) -> bool:
    """Returns whether the bounding box of an obstacle meets the axis of the cylinder."""
    turn = matrix_from_quaternion(solid.quaternion)
    centre, half = solid.position + turn @ solid.middle, np.abs(turn) @ solid.half_extents
    low, high = centre[2] - half[2], centre[2] + half[2]
    return bool((np.abs(centre[:2] - space.center) < half[:2]).all() and low < space.top and high > space.bottom)
