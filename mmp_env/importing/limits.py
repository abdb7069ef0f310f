"""Limits of an imported arm: from the source where it has them, else stated defaults, each with a note that says so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.importing.chain import Chain
from mmp_env.mujoco_import import mujoco
from mmp_env.wording import LEAST_DEGREES

ACCELERATION, JERK = 8.0, 4000.0
"""Defaults of hinges [rad/s^2, rad/s^3], those of the built-in robots whose vendors publish none."""
SLIDE_ACCELERATION, SLIDE_JERK = 2.0, 1000.0
"""Defaults of slides [m/s^2, m/s^3]."""
VELOCITY, SLIDE_VELOCITY = 2.0, 0.5
"""Defaults [rad/s, m/s] where the source has no velocity limit."""
CONTINUOUS_RAD = 2 * np.pi
"""Limit on both sides of a hinge without limits. Random configurations are drawn within +-pi."""
_EFFORT_FACTOR, _LEAST_EFFORT = 2.0, 10.0
_SAMPLES = 200


@dataclass(frozen=True, kw_only=True, eq=False)
class Limits:
    """Limits of the joints [dof], in rad or m, per second to the power that they have; `notes` names the defaults."""

    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]
    draw: Float[np.ndarray, "dof 2"]
    velocity: Float[np.ndarray, "dof"]
    acceleration: Float[np.ndarray, "dof"]
    jerk: Float[np.ndarray, "dof"]
    effort: Float[np.ndarray, "dof"]
    armature: Float[np.ndarray, "dof"]
    notes: tuple[str, ...]


def limits_of(chain: Chain) -> Limits:
    """Returns the limits of a chain's joints."""
    model, joints, slide = chain.source.model, list(chain.joints), np.array(chain.is_slide)
    notes = []
    limited = np.array([bool(model.jnt_limited[j]) for j in joints])
    bounds = np.where(limited[:, None], model.jnt_range[joints], [[-CONTINUOUS_RAD, CONTINUOUS_RAD]])
    if not limited.all():
        notes.append(
            f"joints without limits turn by {CONTINUOUS_RAD:.4g} rad to either side: {_named(chain, ~limited)}"
        )
    as_degrees = ~slide & (np.abs(bounds).max(axis=1) >= LEAST_DEGREES)
    if as_degrees.any():
        notes.append(f"limits are read as radians, and these look like degrees: {_named(chain, as_degrees)}")
    names = [model.joint(j).name for j in joints]
    known = np.array([name in chain.source.velocity for name in names])
    velocity = np.where(slide, SLIDE_VELOCITY, VELOCITY)
    velocity[known] = [chain.source.velocity[name] for name in names if name in chain.source.velocity]
    if not known.all():
        notes.append(
            f"the source has no velocity limits; the defaults are {VELOCITY:g} rad/s and {SLIDE_VELOCITY:g} m/s:"
            f" {_named(chain, ~known)}"
        )
    notes.append(
        f"accelerations and jerks are defaults: {ACCELERATION:g} rad/s^2 and {JERK:g} rad/s^3, slides"
        f" {SLIDE_ACCELERATION:g} m/s^2 and {SLIDE_JERK:g} m/s^3"
    )
    effort = np.array([_effort(model, j) for j in joints])
    guessed = ~(effort > 0)
    if guessed.any():
        effort[guessed] = np.maximum(_EFFORT_FACTOR * _holding_effort(chain), _LEAST_EFFORT)[guessed]
        notes.append(f"efforts are twice those that hold the arm against gravity: {_named(chain, guessed)}")
    armature = np.array([float(model.dof_armature[model.jnt_dofadr[j]]) for j in joints])
    unset = armature <= 0
    armature[unset] = np.clip(effort / 1000, 0.005, 0.1)[unset]
    lower, upper = bounds[:, 0], bounds[:, 1]
    # One turn of a hinge that turns farther holds all configurations.
    whole_turn = ~slide & (upper - lower > 2 * np.pi)
    draw = np.where(whole_turn[:, None], np.clip(bounds, -np.pi, np.pi), bounds)
    return Limits(
        lower=lower,
        upper=upper,
        draw=draw,
        velocity=velocity,
        acceleration=np.where(slide, SLIDE_ACCELERATION, ACCELERATION),
        jerk=np.where(slide, SLIDE_JERK, JERK),
        effort=effort,
        armature=armature,
        notes=tuple(notes),
    )


def _effort(model: Any, joint: int) -> float:
    """The largest force or torque that the source gives a joint, 0 where it gives none."""
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).max())
    for a in range(model.nu):
        if int(model.actuator_trntype[a]) != int(mujoco.mjtTrn.mjTRN_JOINT) or model.actuator_trnid[a, 0] != joint:
            continue
        gear = abs(float(model.actuator_gear[a, 0]))
        if model.actuator_forcelimited[a]:
            return float(np.abs(model.actuator_forcerange[a]).max()) * gear
        is_motor = float(model.actuator_gainprm[a, 0]) == 1.0 and not np.any(model.actuator_biasprm[a, :3])
        if is_motor and model.actuator_ctrllimited[a]:
            return float(np.abs(model.actuator_ctrlrange[a]).max()) * gear
    return 0.0


def _holding_effort(chain: Chain) -> Float[np.ndarray, "dof"]:
    """The largest force or torque of gravity on each joint over random configurations."""
    model = chain.source.model
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    columns = [int(model.jnt_dofadr[j]) for j in chain.joints]
    out, force = np.zeros(len(columns)), np.zeros(model.nv)
    for _ in range(_SAMPLES):
        for j in chain.joints:
            low, high = model.jnt_range[j] if model.jnt_limited[j] else (-np.pi, np.pi)
            data.qpos[model.jnt_qposadr[j]] = random.uniform(low, high)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_rne(model, data, 0, force)
        out = np.maximum(out, np.abs(force[columns]))
    return out


def _named(chain: Chain, chosen: np.ndarray) -> str:
    return ", ".join(name for name, is_chosen in zip(chain.joint_names, chosen, strict=True) if is_chosen)
