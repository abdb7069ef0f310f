"""Events of an environment: a cart that moves through the cell, and new goals while the arms move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.cell_instance import CellInstance, InstanceSource
from mmp_env.gym.observation import Observer
from mmp_env.model.cell import Cell
from mmp_env.sim.cart import CART, Cart, CartOptions
from mmp_env.sim.cart_simulation import CartSimulation
from mmp_env.sim.simulation import Simulation

GivenEvents: TypeAlias = str | Sequence[str] | Mapping[str, Mapping[str, float] | None] | None
"""Names of events, or name -> options, or None for no events."""


@dataclass(frozen=True, kw_only=True)
class GoalOptions:
    """When all arms get new goals: when all have reached theirs, or after a while.

    Args:
        every_s: longest time until the next goals [s].

    Raises:
        MmpError: for a time that is not above 0.
    """

    every_s: float = 10.0

    def __post_init__(self) -> None:
        number("every_s of the goals", self.every_s, "a time above 0 [s]")


_KINDS: dict[str, type[CartOptions] | type[GoalOptions]] = {CART: CartOptions, "goals": GoalOptions}


class WorldEvents:
    """The events of one environment.

    Args:
        given: names of events, `cart` and `goals`, or name -> options.

    Attributes:
        goals_reached: how often all arms have reached their goals since `begin`.

    Raises:
        MmpError: for an unknown event or option, or a bad value.
    """

    def __init__(self, given: GivenEvents) -> None:
        options = {name: _options(name, each) for name, each in _by_name(given).items()}
        cart, goals = options.get(CART), options.get("goals")
        self._cart = cart if isinstance(cart, CartOptions) else None
        self._goals = goals if isinstance(goals, GoalOptions) else None
        self._rng = np.random.default_rng(0)
        self._left_s, self.goals_reached = 0.0, 0

    @property
    def ends_at_goal(self) -> bool:
        """Whether an episode ends when the arms have reached their goals, since they get no others."""
        return self._goals is None

    def simulation(self, cell: Cell, *, self_contacts: bool) -> Simulation:
        """Returns a simulation of the cell, with the cart if there is one. Raises like `Simulation`."""
        if self._cart is None:
            return Simulation(cell, self_contacts=self_contacts)
        return CartSimulation(Cart(cell, self._cart), self_contacts=self_contacts)

    def check(self, instance: CellInstance, source: InstanceSource) -> None:
        """Raises `MmpError` if the instance has objects of a task, so that other goals have other objects."""
        if self._goals is not None and instance.cell is not source.cell:
            raise MmpError(
                "the task draws objects with its goals; the event 'goals' needs a task without, such as reach"
            )

    def begin(self, rng: np.random.Generator, simulation: Simulation) -> None:
        """Begins the events of an episode, drawn by a child of `rng`, whose own numbers stay the same."""
        if self._cart is None and self._goals is None:
            return
        cart_rng, self._rng = rng.spawn(2)
        if isinstance(simulation, CartSimulation):
            simulation.cart.begin(cart_rng)
        self._renew()
        self.goals_reached = 0

    def info(self) -> dict[str, int]:
        """Returns what the events add to the info of a step: `goals_reached`, if goals change."""
        return {} if self._goals is None else {"goals_reached": self.goals_reached}

    def next_instance(
        self, source: InstanceSource, here: Mapping[str, Float[np.ndarray, "_dof"]], seconds: float, *, reached: bool
    ) -> CellInstance | None:
        """Returns the instance with new goals after a step, or None if the goals stay.

        Args:
            source: draws the goals.
            here: arm name -> configuration [dof] [rad], where the new instance starts.
            seconds: duration of the step.
            reached: whether all arms are at their goals.
        """
        if self._goals is None:
            return None
        self.goals_reached += reached
        self._left_s -= seconds
        if not reached and self._left_s > seconds / 2:
            return None
        self._renew()
        return replace(source.drawn(self._rng), start=dict(here))

    def _renew(self) -> None:
        if self._goals is not None:
            self._left_s = self._goals.every_s


class CartObserver(Observer):
    """Observes the cart too: `cart_position` and `cart_velocity` [3] [m], [m/s]. `clearance` includes it."""

    _simulation: CartSimulation

    def _bounds(self) -> dict[str, tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]]:
        cart = self._simulation.cart
        fastest = np.full(3, cart.options.speed)
        return super()._bounds() | {
            "cart_position": (np.minimum(cart.low, cart.outside), np.maximum(cart.high, cart.outside)),
            "cart_velocity": (-fastest, fastest),
        }

    def look(self, out: Float[np.ndarray, "size"]) -> None:
        """As in `Observer`."""
        super().look(out)
        parts, cart = self._parts, self._simulation.cart
        out[parts["clearance"]] = np.minimum(out[parts["clearance"]], self._simulation.cart_clearance())
        out[parts["cart_position"]], out[parts["cart_velocity"]] = cart.place, cart.velocity


def observer(simulation: Simulation) -> Observer:
    """Returns the observer of a simulation, with or without a cart."""
    return CartObserver(simulation) if isinstance(simulation, CartSimulation) else Observer(simulation)


def _by_name(given: GivenEvents) -> Mapping[str, Any]:
    if given is None:
        return {}
    if isinstance(given, str):
        return {given: None}
    if isinstance(given, Mapping):
        return given
    if isinstance(given, Sequence) and all(isinstance(name, str) for name in given):
        return dict.fromkeys(given)
    raise refused("events", given, "names of events, such as ['cart', 'goals'], or name -> options")


def _options(name: str, given: Any) -> CartOptions | GoalOptions:
    if name not in _KINDS:
        raise UnknownNameError("event", name, _KINDS)
    kind = _KINDS[name]
    options = {} if given is None else given
    if not isinstance(options, Mapping):
        raise refused(f"event '{name}'", given, "a dict of its options")
    known = [field.name for field in fields(kind)]
    for option in options:
        if option not in known:
            raise UnknownNameError(f"option of event '{name}'", option, known)
    return kind(**options)
