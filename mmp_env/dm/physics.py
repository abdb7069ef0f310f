"""The physics of a cell for dm_control. Stepping records every contact between two actions."""

from __future__ import annotations

from typing import Any

from dm_control import mujoco

from mmp_env.model.cell import Cell
from mmp_env.sim.scene import compile_scene
from mmp_env.sim.simulation import Simulation


class CellPhysics(mujoco.Physics):
    """`dm_control.mujoco.Physics` of the model of `MultiArmCell`, with its names: `named.data.qpos["arm0/joint1"]`."""

    _simulation: Simulation | None = None
    _self_contacts = True

    @classmethod
    def of(cls, cell: Cell, *, self_contacts: bool) -> CellPhysics:
        """Returns the physics of a cell. Raises `MmpError` if its model does not compile."""
        physics = cls.from_model(_model(cell))
        physics._self_contacts = self_contacts
        physics._simulation = Simulation(cell, physics.data.ptr, self_contacts=self_contacts)
        return physics

    def __getstate__(self) -> tuple[Any, Cell | None, bool]:
        return self.data, self._simulation and self._simulation.cell, self._self_contacts

    def __setstate__(self, state: tuple[Any, Cell | None, bool]) -> None:
        data, cell, self._self_contacts = state
        super().__setstate__(data)
        if cell is not None:
            self._simulation = Simulation(cell, self.data.ptr, self_contacts=self._self_contacts)

    def enter(self, cell: Cell) -> None:
        """Changes to the model and data of another cell.

        The viewer and cameras of dm_control notice. Views of `data` and `named` that a caller has kept do not.
        """
        if self.simulation.cell is not cell:
            self._reload_from_model(_model(cell))
            self._simulation = Simulation(cell, self.data.ptr, self_contacts=self._self_contacts)

    @property
    def simulation(self) -> Simulation:
        """The simulation of the same `MjData`. A `copy()`, which is for looking ahead, has none."""
        if self._simulation is None:
            raise TypeError("a copy of the physics of a cell can be stepped, but not driven by the task")
        return self._simulation

    def step(self, nstep: int = 1) -> None:
        """Advances by `nstep` physics steps. Raises `PhysicsError` if they diverge."""
        if self._simulation is None:
            super().step(nstep)
            return
        with self.check_invalid_state():
            self._simulation.advance(nstep)


def _model(cell: Cell) -> mujoco.wrapper.MjModel:
    return mujoco.wrapper.MjModel(compile_scene(cell, moving_setpoints=True))
