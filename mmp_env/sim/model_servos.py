"""Drives joints of a user's model: by its position actuators, or by placing joints that have none."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree

_JOINT_TRANSMISSIONS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_FIXED, _AFFINE = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_AFFINE)
_NONE, _INTEGRATOR = int(mujoco.mjtDyn.mjDYN_NONE), int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
_FILTERS = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))


class ModelServos:
    """The actuators of a model, of which some drive the given joints.

    A position actuator has the force gain * u + b0 + b1 * length + b2 * velocity, with b1 < 0. Here u is its control or
    its activation. On the reference, its force balances gravity, damping and its own velocity term, so the joint does
    not lag on a ramp.
    """

    def __init__(self, tree: ModelTree, data: Any, joints: Sequence[int]) -> None:
        """Args:
        tree: the model.
        data: its state; where it is now, the actuators of all other joints hold theirs.
        joints: the joints to drive.

        Raises:
            MmpError: if two position actuators drive one of them.
        """
        model = tree.model
        self._model, self._data = model, data
        self._still, self._driven_qpos = mujoco.MjData(model), model.jnt_qposadr[list(joints)]  # without velocity
        mujoco.mj_forward(model, data)
        servo_of = {int(model.actuator_trnid[a, 0]): a for a in range(model.nu) if _drives_joint(model, a)}
        _refuse_rivals(tree, set(joints))
        driven = [(k, servo_of[joint]) for k, joint in enumerate(joints) if joint in servo_of]
        self._column = np.array([k for k, _ in driven], dtype=int)
        self._servo = np.array([a for _, a in driven], dtype=int)
        self._servo_dof = model.jnt_dofadr[[joints[k] for k in self._column]]
        self._free = np.array([k for k, joint in enumerate(joints) if joint not in servo_of], dtype=int)
        self._free_qpos = model.jnt_qposadr[[joints[k] for k in self._free]]
        self._free_dof = model.jnt_dofadr[[joints[k] for k in self._free]]
        self._gear = model.actuator_gear[self._servo, 0]
        self._gain, self._bias = model.actuator_gainprm[self._servo, 0], model.actuator_biasprm[self._servo]
        for a in range(model.nu):
            if a not in self._servo and _is_position(model, a):
                self._set(np.array([a]), -_setpoint(model, a, float(data.actuator_length[a])))
        pinned = _pinned(tree, joints, {int(model.actuator_trnid[a, 0]) for a in servo_of.values()})
        self._pinned = [(slice(at, at + size), data.qpos[at : at + size].copy()) for at, size, _ in pinned]
        self._pinned_dof = np.array([dof for _, _, dofs in pinned for dof in dofs], dtype=int)

    def command(self, wanted: Float[np.ndarray, "n"], rate: Float[np.ndarray, "n"]) -> None:
        """Gives the position actuators a reference and its velocity."""
        dof, gear, velocity = self._servo_dof, self._gear, rate[self._column]
        resistance = self._gravity(wanted)[dof] + self._model.dof_damping[dof] * velocity
        length = gear * wanted[self._column]
        bias = self._bias[:, 0] + self._bias[:, 1] * length + self._bias[:, 2] * gear * velocity
        self._set(self._servo, (resistance / gear - bias) / self._gain)

    def _gravity(self, wanted: Float[np.ndarray, "n"]) -> Float[np.ndarray, "nv"]:
        """Returns the forces that hold the model at rest on the reference, without what its bodies compensate."""
        model, still, out = self._model, self._still, np.zeros(self._model.nv)
        still.qpos[:] = self._data.qpos
        still.qpos[self._driven_qpos] = wanted
        mujoco.mj_kinematics(model, still)
        mujoco.mj_comPos(model, still)
        mujoco.mj_rne(model, still, 0, out)
        return out - self._data.qfrc_gravcomp

    def place(self, wanted: Float[np.ndarray, "n"], rate: Float[np.ndarray, "n"]) -> None:
        """Places the driven joints that have no position actuator, and those that stay where they are."""
        data = self._data
        data.qpos[self._free_qpos], data.qvel[self._free_dof] = wanted[self._free], rate[self._free]
        for part, values in self._pinned:
            data.qpos[part] = values
        data.qvel[self._pinned_dof] = 0.0

    def _set(self, actuators: np.ndarray, value: Any) -> None:
        """Sets the control, or for actuators that integrate it, the activation."""
        model, data = self._model, self._data
        value = np.broadcast_to(value, len(actuators))
        for a, u in zip(actuators.tolist(), value.tolist(), strict=True):
            kind, act = int(model.actuator_dyntype[a]), int(model.actuator_actadr[a])
            data.ctrl[a] = 0.0 if kind == _INTEGRATOR else u
            if kind == _INTEGRATOR:
                data.act[act] = u


def _is_position(model: Any, a: int) -> bool:
    """Returns whether an actuator pulls to a position that its control or activation sets."""
    kinds = int(model.actuator_gaintype[a]) == _FIXED and int(model.actuator_biastype[a]) == _AFFINE
    dynamics = int(model.actuator_dyntype[a]) in (_NONE, _INTEGRATOR, *_FILTERS)
    gain, stiffness = float(model.actuator_gainprm[a, 0]), float(model.actuator_biasprm[a, 1])
    return kinds and dynamics and gain != 0 and stiffness < 0


def _drives_joint(model: Any, a: int) -> bool:
    is_joint = int(model.actuator_trntype[a]) in _JOINT_TRANSMISSIONS and model.actuator_gear[a, 0] != 0
    return is_joint and _is_position(model, a)


def _refuse_rivals(tree: ModelTree, joints: Set[int]) -> None:
    """Raises `MmpError` if two position actuators drive one of the joints: their forces add up."""
    model, servo_of = tree.model, {}
    for a in range(model.nu):
        joint = int(model.actuator_trnid[a, 0])
        if not _drives_joint(model, a) or joint not in joints:
            continue
        name = model.actuator(a).name or f"actuator {a}"
        if joint in servo_of:
            raise MmpError(
                f"the position actuators '{servo_of[joint]}' and '{name}' both drive joint '{tree.joint_name(joint)}';"
                " a joint of an arm has one at most"
            )
        servo_of[joint] = name


def _setpoint(model: Any, a: int, length: float) -> float:
    """Returns minus the control at which a position actuator at rest has no force."""
    return (float(model.actuator_biasprm[a, 0]) + float(model.actuator_biasprm[a, 1]) * length) / float(
        model.actuator_gainprm[a, 0]
    )


def _pinned(tree: ModelTree, joints: Sequence[int], served: set[int]) -> list[tuple[int, int, range]]:
    """Returns address, size and velocities of the joints that carry an arm or hang on one, and have no servo."""
    model, driven = tree.model, set(joints)
    bodies = set(tree.links_of(joints))
    near = {j for joint in joints for j in tree.above(int(model.jnt_bodyid[joint]))}
    near |= {j for body in bodies for j in tree.joints[body]}
    out = []
    for joint in sorted(near - driven - served):
        kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
        size, freedom = {mujoco.mjtJoint.mjJNT_FREE: (7, 6), mujoco.mjtJoint.mjJNT_BALL: (4, 3)}.get(kind, (1, 1))
        dof = int(model.jnt_dofadr[joint])
        out.append((int(model.jnt_qposadr[joint]), size, range(dof, dof + freedom)))
    return out
