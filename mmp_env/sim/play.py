"""Plays plans in the MuJoCo model that their cell was made from."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import given
from mmp_env.errors import MmpError, MovedBodyWarning
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.mujoco_import import mujoco
from mmp_env.problems.making import MOVED
from mmp_env.sim.contacts import ContactLog
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.model_servos import ModelServos
from mmp_env.sim.model_tree import ModelTree
from mmp_env.sim.monitor import Monitor
from mmp_env.sim.scene import compile_scene


def play(plan: Plan, model: Any, data: Any, *, monitor: Monitor | None = None) -> ExecutionReport:
    """Plays a plan in the model that its cell was made from, and returns the report.

    Position actuators on the joints of the arms follow the plan. A joint without one, such as a joint with a motor, is
    placed on the plan at every physics step. The other position actuators hold their joints where they are, and all
    other actuators keep their `ctrl`. Held joints that carry an arm, or hang on one, stay where they are.

    Args:
        plan: A plan of a cell of `cell_from_mujoco`.
        model: The `mujoco.MjModel` of the cell.
        data: Its `mujoco.MjData`, which this function advances. Arms that are elsewhere are first put at the start of
            the plan.
        monitor: Stops all arms when one of them lags.

    Raises:
        MmpError: for a plan of another model, one that is malformed or too long, and if the physics diverges.
    """
    given_plan(plan, "play")
    given("model", model, mujoco.MjModel, "a mujoco.MjModel")
    given("data", data, mujoco.MjData, "a mujoco.MjData of that model")
    if data.model is not model and data.qpos.shape != (model.nq,):
        raise MmpError(f"data has {len(data.qpos)} positions and the model {model.nq}; they belong to different models")
    simulation = ModelSimulation(plan.problem.cell, model, data)
    _warn_of_moved_bodies(plan.problem.cell, data)
    return execute_plan(simulation, plan, monitor=monitor)


def _warn_of_moved_bodies(cell: Cell, data: Any) -> None:
    """Warns if joints or bodies of no arm are elsewhere than in the cell, where the plan does not expect them."""
    if cell.joints is None or len(cell.joints.qpos) != len(data.qpos):
        return
    index, away = cell.joints.deviation(data.qpos)
    if away > MOVED:
        warnings.warn(
            f"data.qpos[{index}] is {data.qpos[index]:.4g}, and cell '{cell.name}' was made with"
            f" {cell.joints.qpos[index]:.4g}; make it with cell_from_mujoco(..., qpos=data.qpos), and plan again",
            MovedBodyWarning,
            stacklevel=3,
        )


class ModelSimulation:
    """A user's model and its state, driven like the simulation of a cell.

    Raises:
        MmpError: if the model is not the one that the cell was made from.
    """

    def __init__(self, cell: Cell, model: Any, data: Any) -> None:
        self.cell, self.model, self.data = cell, model, data
        self._tree = ModelTree(model)
        joints = _joints(cell, self._tree)
        flat = [joint for ids in joints.values() for joint in ids]
        self._qpos, self._dof = model.jnt_qposadr[flat], model.jnt_dofadr[flat]
        ends = np.cumsum([len(ids) for ids in joints.values()]).tolist()
        self.slices = {name: slice(end - len(ids), end) for (name, ids), end in zip(joints.items(), ends, strict=True)}
        self.count: int = ends[-1]
        self.timestep_s = float(model.opt.timestep)
        self._servos = ModelServos(self._tree, data, flat)
        self._largest_torques = np.zeros(self.count)
        self.log = _contact_log(cell, self._tree, data, joints)
        mujoco.mj_forward(model, data)

    @property
    def positions(self) -> Float[np.ndarray, "n"]:
        """Joint positions of the arms, a new array."""
        return self.data.qpos[self._qpos]

    @property
    def velocities(self) -> Float[np.ndarray, "n"]:
        """Joint velocities of the arms, a new array."""
        return self.data.qvel[self._dof]

    @property
    def largest_torques(self) -> Float[np.ndarray, "n"]:
        """Largest torque of each joint's actuators since the log began; 0 for joints that are placed."""
        return self._largest_torques.copy()

    @property
    def scene_model(self) -> Any:
        """The model of `compile_scene`, which has the arms and obstacles of the cell."""
        return compile_scene(self.cell, moving_setpoints=True)

    def joined(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> Float[np.ndarray, "n"]:
        """Returns one vector [n] of a configuration per arm."""
        return np.concatenate([q[name] for name in self.slices])

    def split(self, q: Float[np.ndarray, "*t n"]) -> dict[str, Float[np.ndarray, "*t dof"]]:
        """Returns arm name -> its part of the last axis, as a copy."""
        return {name: q[..., part].copy() for name, part in self.slices.items()}

    def place(self, q: Float[np.ndarray, "n"]) -> None:
        """Puts all arms at rest at `q`."""
        self.data.qpos[self._qpos], self.data.qvel[self._dof] = q, 0.0
        mujoco.mj_forward(self.model, self.data)

    def begin_log(self) -> None:
        """Empties the log and records what touches now."""
        self.log.clear(float(self.data.time))
        self._largest_torques[:] = 0.0
        self.log.note(self.data.time)

    def follow(
        self,
        reference: Float[np.ndarray, "t n"],
        velocity: Float[np.ndarray, "t n"],
        end: Float[np.ndarray, "n"] | None = None,
    ) -> Float[np.ndarray, "t n"]:
        """Drives the arms along a reference, and returns their positions after each physics step.

        Args:
            reference: row k is the reference at the begin of physics step k.
            velocity: its velocities.
            end: the reference after the last step; by default its velocity goes on.

        Raises:
            MmpError: if the physics diverges.
        """
        model, data, passed = self.model, self.data, np.empty_like(reference)
        last = reference[-1] + self.timestep_s * velocity[-1] if end is None else end
        after = np.vstack([reference[1:], last])
        for row, wanted, rate, then in zip(passed, reference, velocity, after, strict=True):
            begin_s = data.time
            self._servos.command(wanted, rate)
            mujoco.mj_step(model, data)
            if data.time < begin_s + self.timestep_s / 2:  # MuJoCo resets a state that diverges
                raise MmpError(
                    f"the simulation of the model diverged after {begin_s:.3f} s; its actuators or masses are unstable"
                    f" at its time step of {self.timestep_s:g} s"
                )
            np.maximum(self._largest_torques, np.abs(data.qfrc_actuator[self._dof]), out=self._largest_torques)
            self._servos.place(then, rate)
            mujoco.mj_fwdPosition(model, data)  # contacts of the new state
            row[:] = data.qpos[self._qpos]
            self.log.note(self.data.time)
        return passed


def _joints(cell: Cell, tree: ModelTree) -> dict[str, list[int]]:
    """Returns arm name -> its joints in the model. Raises `MmpError`."""
    if cell.joints is None:
        raise MmpError(f"cell '{cell.name}' was not made from a MuJoCo model; execute its plans with env.execute")
    numbers = {tree.joint_name(joint): joint for joint in range(tree.model.njnt)}
    out: dict[str, list[int]] = {}
    for arm, names in cell.joints.names.items():
        for name, address in zip(names, cell.joints.addresses[arm], strict=True):
            joint = numbers.get(name)
            if joint is None or int(tree.model.jnt_qposadr[joint]) != address:
                raise MmpError(
                    f"the plan is for another model: joint '{name}' of arm '{arm}' is at qpos[{address}] there, and"
                    f" {'missing' if joint is None else f'at qpos[{int(tree.model.jnt_qposadr[joint])}]'} here"
                )
            out.setdefault(arm, []).append(joint)
    return out


def _contact_log(cell: Cell, tree: ModelTree, data: Any, joints: Mapping[str, list[int]]) -> ContactLog:
    """Returns a log that leaves out contacts within a link and between links that the planners let overlap."""
    names, owners = [f"obstacle/{name}" for name in tree.geom_names], [len(cell.arms)] * tree.model.ngeom
    allowed: set[frozenset[str]] = set()
    for number, arm in enumerate(cell.arms):
        links = [f"{arm.name}/{link}" for link in arm.robot.link_names]
        for body, link in tree.links_of(joints[arm.name]).items():
            for geom in tree.geoms(body):
                names[geom], owners[geom] = links[link], number
        allowed |= {frozenset((link,)) for link in links}
        allowed |= {frozenset((links[i], links[j])) for i, j in arm.robot.self_ignore[cell.spheres]}
    for obstacle in cell.obstacles:
        allowed |= {frozenset((link, f"obstacle/{obstacle.name}")) for link in obstacle.may_touch}
    return ContactLog(tree.model, data, names, owners, arms=len(cell.arms), allowed=allowed)
