"""The physics of a cell as dm_control has it, stepped so that no contact between two actions is missed."""

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
        """The physics of a cell. Raises `MmpError` where it does not compile."""
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
        """From here on these are the physics of that cell: a new model and new data, where it is another cell.

        dm_control's viewer and cameras notice; views of `data` and `named` that somebody has kept do not.
        """
        if self.simulation.cell is not cell:
            self._reload_from_model(_model(cell))
            self._simulation = Simulation(cell, self.data.ptr, self_contacts=self._self_contacts)

    @property
    def simulation(self) -> Simulation:
        """What drives and watches the same `MjData`. What `copy()` returns has none; it is for looking ahead."""
        if self._simulation is None:
            raise TypeError("a copy of the physics of a cell can be stepped, but not driven by the task")
        return self._simulation

    def step(self, nstep: int = 1) -> None:
        """Lets `nstep` physics steps pass. Raises `PhysicsError` where they diverge."""
        if self._simulation is None:
            super().step(nstep)
            return
        with self.check_invalid_state():
            self._simulation.advance(nstep)


def _model(cell: Cell) -> mujoco.wrapper.MjModel:
    return mujoco.wrapper.MjModel(compile_scene(cell, moving_setpoints=True))
