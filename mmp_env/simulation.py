"""A cell in motion: one MuJoCo model and its state, driven through the position servos of all arms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.cell import Cell
from mmp_env.contacts import ContactLog
from mmp_env.mujoco_import import mujoco
from mmp_env.scene import compile_scene


class Simulation:
    """`model` and `data` of MuJoCo, with the joints of all arms in one vector [n]: arm after arm, base to flange.

    Between calls `data` is what `mj_step1` leaves: poses and contacts belong to the positions that one reads.
    """

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.model = compile_scene(cell)
        self.data = mujoco.MjData(self.model)
        self.log = ContactLog(self.model, cell)
        joints = [self.model.joint(f"{arm.name}/joint{k + 1}") for arm in cell.arms for k in range(arm.dof)]
        servos = [self.model.actuator(f"{arm.name}/servo{k + 1}") for arm in cell.arms for k in range(arm.dof)]
        self.qpos_index = _index([joint.qposadr[0] for joint in joints])
        self._qvel = _index([joint.dofadr[0] for joint in joints])
        self._ctrl = _index([servo.id for servo in servos])
        tools = [f"{arm.name}/{'tool_point' if arm.tool else 'flange'}" for arm in cell.arms]
        self._tools = _index([self.model.site(name).id for name in tools])
        self._lead_s = _velocity_lead(self.model)[self._ctrl]
        ends = np.cumsum([arm.dof for arm in cell.arms]).tolist()
        self.slices = {arm.name: slice(end - arm.dof, end) for arm, end in zip(cell.arms, ends, strict=True)}
        self.count = ends[-1]

    @property
    def timestep_s(self) -> float:
        return float(self.model.opt.timestep)

    @property
    def positions(self) -> Float[np.ndarray, "n"]:
        """Joint positions [rad], a fresh array."""
        return self.data.qpos[self.qpos_index]

    @property
    def velocities(self) -> Float[np.ndarray, "n"]:
        """Joint velocities [rad/s], a fresh array."""
        return self.data.qvel[self._qvel]

    @property
    def tool_points(self) -> Float[np.ndarray, "a 3"]:
        """Each arm's tool point in the world [m], its flange where it has no tool; a fresh array."""
        return self.data.site_xpos[self._tools]

    def joined(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> Float[np.ndarray, "n"]:
        """One vector of a configuration per arm."""
        return np.concatenate([q[name] for name in self.slices])

    def split(self, q: Float[np.ndarray, "*t n"]) -> dict[str, Float[np.ndarray, "*t dof"]]:
        """Arm name -> its part of the last axis, copied."""
        return {name: q[..., part].copy() for name, part in self.slices.items()}

    def place(self, q: Float[np.ndarray, "n"]) -> None:
        """Puts all arms at rest at `q` [rad], the servos holding them there; the clock starts at 0."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.qpos_index] = q
        self.data.ctrl[self._ctrl] = q
        mujoco.mj_step1(self.model, self.data)
        self.begin_log()

    def begin_log(self) -> None:
        """Forgets the contacts so far and counts the time of those to come from now; what touches now is the first."""
        self.log.clear(float(self.data.time))
        if self.data.ncon:
            self.log.note(self.data)

    def advance(
        self, reference: Float[np.ndarray, "t n"], velocity: Float[np.ndarray, "#t n"]
    ) -> Float[np.ndarray, "t n"]:
        """Follows `reference` [rad] with feed-forward `velocity` [rad/s], one physics step a row; contacts go to `log`.

        Row k says where the arms should be at the beginning of step k. Returns where they are at its end.
        Raises `RuntimeError` where the physics diverges.
        """
        model, data, log = self.model, self.data, self.log
        step_1, step_2, qpos, ctrl = mujoco.mj_step1, mujoco.mj_step2, data.qpos, data.ctrl
        commands = np.empty((len(reference), model.nu))
        commands[:, self._ctrl] = reference + self._lead_s * velocity
        passed = np.empty((len(reference), len(qpos)))
        begin_s = data.time
        # The same work as mj_step, cut so that poses and contacts are those of the state that a step leads to.
        for command, row in zip(commands, passed, strict=True):
            ctrl[:] = command
            step_2(model, data)
            step_1(model, data)
            row[:] = qpos
            if data.ncon:
                log.note(data)
            else:
                log.skip()
        if data.time < begin_s + (len(reference) - 0.5) * self.timestep_s:
            raise RuntimeError(f"the simulation of cell '{self.cell.name}' diverged; the servos or masses are unsound")
        return passed[:, self.qpos_index]


def _index(values: list[int]) -> Int[np.ndarray, "n"]:
    return np.array(values, dtype=np.intp)


def _velocity_lead(model: Any) -> Float[np.ndarray, "u"]:
    """kv / kp [s] of each position servo, whose force is kp (ctrl - q) - kv dq/dt.

    With ctrl = q_ref + kv / kp dq_ref/dt it is kp (q_ref - q) + kv d(q_ref - q)/dt: no lag behind a ramp.
    """
    return -model.actuator_biasprm[:, 2] / model.actuator_gainprm[:, 0]
