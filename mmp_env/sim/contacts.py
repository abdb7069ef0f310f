"""Contacts in the simulation: bodies, time and depth."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from mmp_env.brief import brief
from mmp_env.model.cell import Cell

PHASE = "/@"
"""Text between the name of a body and a number, where several bodies stand for one at different times."""


@dataclass(frozen=True)
class Contact:
    """A contact of two bodies that begins at `time_s` [s]; `depth_m` [m] is the largest penetration.

    `body_a` is a link or tool such as `arm0/forearm`; `body_b` is `obstacle/<name>`, or a link or tool of a later arm,
    or of the same arm farther from its base.
    """

    time_s: float
    body_a: str
    body_b: str
    depth_m: float

    @brief
    def __repr__(self) -> str:
        return f"of {self.body_a} and {self.body_b} from {self.time_s:.3f} s on, {self.depth_m * 1e3:.2f} mm deep"


@dataclass
class _Touch:
    since_s: float
    until_s: float
    bodies: tuple[str, str]
    depth_m: float


class ContactLog:
    """A log of the contacts of arms with each other, with obstacles and with themselves.

    Every uninterrupted touch of two bodies is one `Contact`.

    Args:
        model: the `mujoco.MjModel` of the cell.
        data: its `mujoco.MjData`, which the log reads.
        names: name of the body of every geom.
        owners: number of the arm of every geom; a number above those of all arms for a geom of none.
        arms: number of arms.
        self_contacts: whether the log records contacts of an arm with itself.
        allowed: pairs of names whose contacts the log leaves out.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        names: list[str],
        owners: list[int],
        *,
        arms: int,
        self_contacts: bool = True,
        allowed: Set[frozenset[str]] = frozenset(),
    ) -> None:
        self._contact = data.contact
        self.self_contacts = self_contacts
        self._names, self._owners, self._arms, self._allowed = names, owners, arms, allowed
        self._bodies: dict[tuple[int, int], tuple[str, str] | None] = {}
        self._longest_gap_s = 1.5 * float(model.opt.timestep)
        self.clear()

    def clear(self, time_s: float = 0.0) -> None:
        """Empties the log. Time counts from `time_s` [s] of the simulation's clock."""
        self._begin_s = time_s
        self._touches: list[_Touch] = []
        self._latest: dict[tuple[str, str], _Touch] = {}

    @property
    def contacts(self) -> list[Contact]:
        """All contacts so far, earliest first, as a new list."""
        return [Contact(touch.since_s, *touch.bodies, touch.depth_m) for touch in self._touches]

    def note(self, at_s: float) -> None:
        """Records the contacts of MuJoCo, which are those at `at_s` [s] of the simulation's clock."""
        time_s = at_s - self._begin_s
        for (geom_1, geom_2), distance in zip(self._contact.geom.tolist(), self._contact.dist.tolist(), strict=True):
            if distance > 0 or geom_1 < 0 or geom_2 < 0:  # within the margin of a geom, or of a flexible body
                continue
            pair = geom_1, geom_2
            if pair not in self._bodies:
                self._bodies[pair] = self._bodies_of(*pair)
            bodies = self._bodies[pair]
            if bodies is None:
                continue
            touch = self._latest.get(bodies)
            if touch is None or time_s > touch.until_s + self._longest_gap_s:
                touch = self._latest[bodies] = _Touch(time_s, time_s, bodies, -distance)
                self._touches.append(touch)
            touch.until_s = time_s
            if -distance > touch.depth_m:
                touch.depth_m = -distance

    def _bodies_of(self, geom_1: int, geom_2: int) -> tuple[str, str] | None:
        """Returns the names of the bodies of two geoms, ordered as in `Contact`; None if the log leaves them out."""
        owners = self._owners
        if owners[geom_1] == owners[geom_2] and (owners[geom_1] == self._arms or not self.self_contacts):
            return None
        # The geoms of an arm are numbered from its base outwards; those of the world come before all others.
        first, second = sorted((geom_1, geom_2), key=lambda geom: (owners[geom], geom))
        bodies = self._names[first], self._names[second]
        return None if frozenset(bodies) in self._allowed else bodies


def names_and_owners(model: Any, cell: Cell) -> tuple[list[str], list[int]]:
    """Returns the body name and the arm number of every geom.

    A geom of the world has the name of its obstacle, and a number above those of all arms. Bodies whose names differ
    after `PHASE` stand for one body at different times, and have one name.
    """
    numbers = {name: k for k, name in enumerate(cell.arm_names)}
    names, owners = [], []
    for geom, body in enumerate(np.asarray(model.geom_bodyid).tolist()):
        name = model.body(body).name.partition(PHASE)[0] if body else "/".join(model.geom(geom).name.split("/")[:2])
        names.append(name)
        owners.append(numbers.get(name.partition("/")[0], len(numbers)) if body else len(numbers))
    return names, owners
