"""A cart: a box that is carried through a cell, from point to point, not faster than a bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import number
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell

CART = "cart"
"""Name of the obstacle."""
_LOWEST_M, _HIGHEST_M = 0.3, 1.2
"""Heights between which the cart moves, above the bases [m]."""
_NARROWEST_M = 0.35
"""Least half width of the space in which the cart moves [m]."""
_OUTSIDE_M, _OUTSIDE_HEIGHT_M = 0.6, 0.5
"""Where the cart begins: so far outside this space, and at this height above the bases [m]."""
_PATIENCE_S = 2.0
"""A cart that stands in front of an arm for so long turns to another point [s]."""


@dataclass(frozen=True, kw_only=True)
class CartOptions:
    """Size and habits of a cart.

    Args:
        edge: edge of the box [m].
        speed: largest speed [m/s].
        stops: distance from an arm at which the cart stops [m]; a cart with 0 stops for no arm.

    Raises:
        MmpError: for a number that is negative or not finite, and for an edge or speed of 0.
    """

    edge: float = 0.15
    speed: float = 0.3
    stops: float = 0.2

    def __post_init__(self) -> None:
        number("edge of the cart", self.edge, "a length above 0 [m]")
        number("speed of the cart", self.speed, "a speed above 0 [m/s]")
        number("stops of the cart", self.stops, "a distance [m], 0 or more", zero=True)


class Cart:
    """The cart of a cell, which `begin` puts outside. It moves in the space between the bases of the arms.

    Args:
        cell: the cell.
        options: size and habits.

    Attributes:
        cell: the cell.
        options: size and habits.
        low, high: corners of the space in which its centre moves [3] [m].
        outside: where it begins [3] [m].
        place: its centre [3] [m].
        velocity: of its last step [3] [m/s].
    """

    def __init__(self, cell: Cell, options: CartOptions) -> None:
        self.cell, self.options = cell, options
        bases = np.array([arm.position for arm in cell.arms])
        middle, half = (bases.max(axis=0) + bases.min(axis=0)) / 2, np.ptp(bases, axis=0) / 2
        half = np.maximum(half[:2], _NARROWEST_M)
        floor = bases[:, 2].min()
        self.low = np.append(middle[:2] - half, floor + _LOWEST_M)
        self.high = np.append(middle[:2] + half, floor + _HIGHEST_M)
        self.outside = np.append(self.high[:2] + _OUTSIDE_M, floor + _OUTSIDE_HEIGHT_M)
        self.begin(np.random.default_rng(0))

    def begin(self, rng: np.random.Generator) -> None:
        """Puts the cart outside. `rng` draws the points to which it goes."""
        self._rng = rng
        self.place, self.velocity = self.outside, np.zeros(3)
        self._to, self._stood_s = self._draw(), 0.0

    def obstacle(self, name: str = CART) -> Obstacle:
        """Returns the cart where it is, with its largest speed."""
        return Obstacle(
            name=name,
            shape="box",
            position=self.place,
            quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
            size=np.full(3, self.options.edge),
            speed=self.options.speed,
        )

    def clearance(self, centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]) -> float:
        """Returns the least distance of the cart from spheres [m], negative if one overlaps it."""
        return self._clearance(self.place, centers, radii)

    def advance(self, centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"], seconds: float) -> None:
        """Moves the cart for a short time [s], unless an arm is in front of it. The spheres are those of the arms."""
        way = self._to - self.place
        length, step = float(np.linalg.norm(way)), self.options.speed * seconds
        place = self.place + way * min(step / max(length, 1e-9), 1.0)
        if self._is_blocked(place, centers, radii):
            self.velocity = np.zeros(3)
            self._stood_s += seconds
        else:
            self.velocity = (place - self.place) / seconds
            self.place, self._stood_s = place, 0.0
        if length < step or self._stood_s > _PATIENCE_S:
            self._to, self._stood_s = self._draw(), 0.0

    def _is_blocked(
        self, place: Float[np.ndarray, "3"], centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
    ) -> bool:
        if self.options.stops == 0:
            return False
        apart = self._clearance(place, centers, radii)
        return apart < self.options.stops and apart < self._clearance(self.place, centers, radii)

    def _clearance(
        self, place: Float[np.ndarray, "3"], centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
    ) -> float:
        apart = np.maximum(np.abs(centers - place) - self.options.edge / 2, 0.0)
        return float((np.sqrt(np.einsum("ij,ij->i", apart, apart)) - radii).min())

    def _draw(self) -> Float[np.ndarray, "3"]:
        return self._rng.uniform(self.low, self.high)
