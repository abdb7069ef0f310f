"""Simulation of a cell: one MuJoCo model and its state, driven through the position servos of all arms."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.contacts import ContactLog, names_and_owners
from mmp_env.sim.scene import compile_scene

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_MOST_UNDONE = 13
"""Largest number of physics steps in one call of MuJoCo: a quarter of 0.1 s. After a contact the call is undone, and
its steps are repeated one by one."""


class Simulation:
    """`model` and `data` of MuJoCo, with the joints of all arms in one vector [n]: arm after arm, base to flange.

    Between calls `data` is in the state after `mj_step1`: poses and contacts belong to the present positions.

    Args:
        cell: the cell.
        data: the `mujoco.MjData` to use, of the model `compile_scene(cell, moving_setpoints=True)`; None makes one.
        self_contacts: whether `log` records contacts of an arm with itself.

    Raises:
        MmpError: if the model does not compile, or has other joints than the cell.
    """

    def __init__(self, cell: Cell, data: Any = None, *, self_contacts: bool = True) -> None:
        self.cell = cell
        self.data = mujoco.MjData(compile_scene(cell, moving_setpoints=True)) if data is None else data
        self.model = self.data.model
        self._before = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        self._touching = False
        # Views of MuJoCo's memory, which MuJoCo does not move.
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._setpoint, self._rate = self.data.act, self.data.ctrl
        self._sites = self.data.site_xpos
        names, owners = names_and_owners(self.model, cell)
        arms = len(cell.arms)
        self.log = ContactLog(self.model, self.data, names, owners, arms=arms, self_contacts=self_contacts)
        self._torques = self.data.qfrc_actuator
        self._largest_torques = np.zeros_like(self._torques)
        _check_order(self.model, cell)
        tools = [f"{arm.name}/{'tool_point' if arm.tool else 'flange'}" for arm in cell.arms]
        self._tools = np.array([self.model.site(name).id for name in tools])
        self._lead_s = _velocity_lead(self.model)
        ends = np.cumsum([arm.dof for arm in cell.arms]).tolist()
        self.slices = {arm.name: slice(end - arm.dof, end) for arm, end in zip(cell.arms, ends, strict=True)}
        self.count: int = ends[-1]
        self.timestep_s = float(self.model.opt.timestep)
        mujoco.mj_step1(self.model, self.data)

    def __reduce__(self) -> tuple[Any, ...]:
        # Views of MuJoCo's memory cannot be copied. The copy has its own views, and an empty log.
        return functools.partial(type(self), self_contacts=self.log.self_contacts), (self.cell, self.data)

    @property
    def positions(self) -> Float[np.ndarray, "n"]:
        """Joint positions [rad], a new array."""
        return self._qpos.copy()

    @property
    def velocities(self) -> Float[np.ndarray, "n"]:
        """Joint velocities [rad/s], a new array."""
        return self._qvel.copy()

    @property
    def scene_model(self) -> Any:
        """The model of `compile_scene`."""
        return self.model

    @property
    def tool_points(self) -> Float[np.ndarray, "a 3"]:
        """Tool point of each arm in the world [m], or its flange without a tool; a new array."""
        return self._sites[self._tools]

    @property
    def largest_torques(self) -> Float[np.ndarray, "n"]:
        """Largest torque of each motor in `follow` since the log began [N m], gravity included; a new array."""
        return self._largest_torques.copy()

    def joined(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> Float[np.ndarray, "n"]:
        """Returns one vector [n] of a configuration per arm."""
        return np.concatenate([q[name] for name in self.slices])

    def split(self, q: Float[np.ndarray, "*t n"]) -> dict[str, Float[np.ndarray, "*t dof"]]:
        """Returns arm name -> its part of the last axis, as a copy."""
        return {name: q[..., part].copy() for name, part in self.slices.items()}

    def place(self, q: Float[np.ndarray, "n"]) -> None:
        """Puts all arms at rest at `q` [rad], with servos that hold them there. The clock starts at 0."""
        mujoco.mj_resetData(self.model, self.data)
        self._qpos[:] = q
        self._setpoint[:] = q
        mujoco.mj_step1(self.model, self.data)
        self.begin_log()

    def begin_log(self) -> None:
        """Empties the log and records what touches now. The time of contacts counts from now."""
        self.log.clear(float(self.data.time))
        self._largest_torques[:] = 0.0
        self._touching = False
        self._note_present()

    def ramp(self, begin: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"], steps: int) -> None:
        """Drives the arms along a straight reference from `begin` to `end` [rad] in `steps` physics steps.

        `log` records the contacts. Raises `MmpError` if the physics diverges.
        """
        for _ in self.ramp_in_parts(begin, end, steps):
            pass

    def ramp_in_parts(self, begin: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"], steps: int) -> Iterator[None]:
        """Does what `ramp` does, and pauses now and then."""
        begin_s = self.set_reference(begin, end, steps)
        yield from self._advance_in_parts(steps)
        self._check_clock(begin_s, steps)

    def set_reference(self, begin: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"], steps: int) -> float:
        """Gives the servos a straight reference for the next `steps` physics steps, and returns the time [s]."""
        velocity = (end - begin) / (steps * self.timestep_s)
        self._setpoint[:], self._rate[:] = begin + self._lead_s * velocity, velocity
        return self.data.time

    def advance(self, steps: int) -> None:
        """Advances by `steps` physics steps; `log` records the contacts. Does not detect divergence."""
        for _ in self._advance_in_parts(steps):
            pass

    def _advance_in_parts(self, steps: int) -> Iterator[None]:
        # Steps of several calls follow one another without the two halves of `mj_step` between them, so `data` may be
        # in the state after `mj_step` here: poses and contacts belong to the instant before.
        split = True
        for first in range(0, steps, _MOST_UNDONE):
            if first:
                yield
            count = min(_MOST_UNDONE, steps - first)
            if not self._touching and self._step_untouched(count, split=split):
                split = False
                continue
            if not split:
                self._note_present()
            self._step_watched(count)
            split = True
        if not split:
            mujoco.mj_step1(self.model, self.data)
            self._note_present()

    def _note_present(self) -> None:
        if self.data.ncon:
            self.log.note(self.data.time)
            self._touching = True

    def _step_untouched(self, steps: int, *, split: bool) -> bool:
        """Takes all steps and leaves out `mj_step1` after the last. If anything touched, undoes them and returns False.

        `split` says whether `data` is in the state after `mj_step1`. It is if the steps are undone.
        """
        model, data = self.model, self.data
        mujoco.mj_getState(model, data, self._before, _STATE)
        data.maxuse_con = 0
        if split:
            mujoco.mj_step2(model, data)
        mujoco.mj_step(model, data, steps - split)
        if data.maxuse_con == 0:
            return True
        mujoco.mj_setState(model, data, self._before, _STATE)
        mujoco.mj_step1(model, data)
        return False

    def _step_watched(self, steps: int) -> None:
        """Takes the steps one by one, and records the contacts after each."""
        model, data, step = self.model, self.data, mujoco.mj_step
        self._touching = False
        mujoco.mj_step2(model, data)
        for _ in range(steps - 1):
            # The contacts after this call are those of the positions before it.
            time_s = data.time
            step(model, data)
            if data.ncon:
                self.log.note(time_s)
                self._touching = True
        mujoco.mj_step1(model, data)
        self._note_present()

    def follow(
        self,
        reference: Float[np.ndarray, "t n"],
        velocity: Float[np.ndarray, "t n"],
        end: Float[np.ndarray, "n"] | None = None,
    ) -> Float[np.ndarray, "t n"]:
        """Drives the arms along a reference, and returns their positions after each step [t, n] [rad].

        Args:
            reference: row k is the reference at the begin of physics step k [rad].
            velocity: its velocities [rad/s].
            end: the reference after the last step [rad].

        Raises:
            MmpError: if the physics diverges.
        """
        # Each step is mj_step in two halves, so that poses and contacts belong to the new state.
        model, data, setpoint, begin_s = self.model, self.data, self._setpoint, self.data.time
        torques, largest = self._torques, self._largest_torques
        self._rate[:] = 0.0
        passed = np.empty_like(reference)
        for row, command in zip(passed, reference + self._lead_s * velocity, strict=True):
            setpoint[:] = command
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
            row[:] = self._qpos
            np.maximum(largest, np.abs(torques), out=largest)
            if data.ncon:
                self.log.note(data.time)
        self._check_clock(begin_s, len(reference))
        return passed

    def _check_clock(self, begin_s: float, steps: int) -> None:
        """Raises `MmpError` after a divergence: MuJoCo then resets the state, time included."""
        if self.data.time < begin_s + (steps - 0.5) * self.timestep_s:
            raise MmpError(f"the simulation of cell '{self.cell.name}' diverged; its servos or masses are unsound")


def _check_order(model: Any, cell: Cell) -> None:
    """Raises `MmpError` if the joints and servos of the model are not those of the cell in the same order."""
    for kind, there in (
        ("joint", [model.joint(k).name for k in range(model.njnt)]),
        ("servo", [model.actuator(k).name for k in range(model.nu)]),
    ):
        expected = [f"{arm.name}/{kind}{k + 1}" for arm in cell.arms for k in range(arm.dof)]
        if there != expected:
            raise MmpError(f"the MJCF of cell '{cell.name}' has {kind}s {there}; expected {expected}")


def _velocity_lead(model: Any) -> Float[np.ndarray, "u"]:
    """Returns kv / kp [s] of each position servo, whose force is kp (setpoint - q) - kv dq/dt.

    With the set point q_ref + kv / kp dq_ref/dt the force is kp (q_ref - q) + kv d(q_ref - q)/dt: no lag on a ramp.
    """
    return -model.actuator_biasprm[:, 2] / model.actuator_gainprm[:, 0]
