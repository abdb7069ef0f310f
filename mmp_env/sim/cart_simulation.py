"""Simulation of a cell with a cart: a body of MuJoCo that moves every few physics steps, and that nothing pushes."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.cart import CART, Cart
from mmp_env.sim.scene import OBSTACLE_PREFIX, add_carried, compile_scene
from mmp_env.sim.simulation import Simulation

_CART_STEPS = 5
"""Physics steps between two motions of the cart."""


class CartSimulation(Simulation):
    """A simulation in which a cart moves while the arms do. `log` names it `obstacle/cart`.

    Args:
        cart: the cart and its cell.
        data: as in `Simulation`, of the model with the cart.
        self_contacts: as in `Simulation`.

    Raises:
        MmpError: like `Simulation`, and if the cell has an obstacle of the same name.
    """

    def __init__(self, cart: Cart, data: Any = None, *, self_contacts: bool = True) -> None:
        cell = cart.cell
        if any(obstacle.name == CART for obstacle in cell.obstacles):
            raise MmpError(f"cell '{cell.name}' has an obstacle '{CART}'; rename it, since the event has that name")
        self.cart = cart
        if data is None:
            add = functools.partial(add_carried, solid=cart.obstacle(), name=OBSTACLE_PREFIX + CART)
            data = mujoco.MjData(compile_scene(cell, moving_setpoints=True, more=add))
        super().__init__(cell, data, self_contacts=self_contacts)
        self._rows = [self._qpos[None, part] for part in self.slices.values()]
        self._bare: Any = None

    def __reduce__(self) -> tuple[Any, ...]:
        return functools.partial(type(self), self_contacts=self.log.self_contacts), (self.cart, self.data)

    @property
    def scene_model(self) -> Any:
        """The model of the cell without the cart, for audits of clearances between arms and obstacles."""
        if self._bare is None:
            self._bare = compile_scene(self.cell, moving_setpoints=True)
        return self._bare

    def place(self, q: Float[np.ndarray, "n"]) -> None:
        """As in `Simulation`; the cart stays where it is."""
        super().place(q)
        self._show_cart()
        self.begin_log()

    def _advance_in_parts(self, steps: int) -> Iterator[None]:
        for first in range(0, steps, _CART_STEPS):
            if first:
                yield
            count = min(_CART_STEPS, steps - first)
            self._move_cart(count)
            yield from super()._advance_in_parts(count)

    def follow(
        self,
        reference: Float[np.ndarray, "t n"],
        velocity: Float[np.ndarray, "t n"],
        end: Float[np.ndarray, "n"] | None = None,
    ) -> Float[np.ndarray, "t n"]:
        """As in `Simulation`; the cart moves too."""
        passed = [np.empty((0, self.count))]
        for first in range(0, len(reference), _CART_STEPS):
            part = slice(first, first + _CART_STEPS)
            self._move_cart(len(reference[part]))
            passed.append(super().follow(reference[part], velocity[part], end))
        return np.concatenate(passed)

    def cart_clearance(self) -> float:
        """Returns the clearance of the arms from the cart [m], negative if one overlaps it."""
        return self.cart.clearance(*self._spheres())

    def _move_cart(self, steps: int) -> None:
        self.cart.advance(*self._spheres(), steps * self.timestep_s)
        self._show_cart()

    def _show_cart(self) -> None:
        self.data.mocap_pos[0] = self.cart.place
        mujoco.mj_step1(self.model, self.data)

    def _spheres(self) -> tuple[Float[np.ndarray, "s 3"], Float[np.ndarray, "s"]]:
        """Returns centres and radii [m] of the spheres of all arms."""
        collision = self.cell.collision
        each = [collision.spheres(arm, q) for arm, q in zip(self.slices, self._rows, strict=True)]
        return np.concatenate([centers[0] for centers, _ in each]), np.concatenate([radii for _, radii in each])
