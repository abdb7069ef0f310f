"""Arms in a simulation that follow a reference: those of a cell's own scene, or of a user's model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.sim.contacts import ContactLog


@runtime_checkable
class Driven(Protocol):
    """The part of a simulation that executions use. `mmp_env.sim.simulation.Simulation` describes the members."""

    cell: Cell
    log: ContactLog
    slices: dict[str, slice]
    count: int
    timestep_s: float

    @property
    def positions(self) -> Float[np.ndarray, "n"]: ...
    @property
    def velocities(self) -> Float[np.ndarray, "n"]: ...
    @property
    def largest_torques(self) -> Float[np.ndarray, "n"]: ...
    @property
    def scene_model(self) -> Any: ...
    def joined(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> Float[np.ndarray, "n"]: ...
    def split(self, q: Float[np.ndarray, "*t n"]) -> dict[str, Float[np.ndarray, "*t dof"]]: ...
    def place(self, q: Float[np.ndarray, "n"]) -> None: ...
    def begin_log(self) -> None: ...
    def follow(
        self,
        reference: Float[np.ndarray, "t n"],
        velocity: Float[np.ndarray, "t n"],
        end: Float[np.ndarray, "n"] | None = None,
    ) -> Float[np.ndarray, "t n"]: ...
