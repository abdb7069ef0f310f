"""Values of the joints of a tool in a state: those given, those of the file, and those of joints that follow others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.mujoco_import import mujoco

TOLERANCE = 1e-6
"""Largest difference [rad or m] of a given value from that which a constraint demands."""


def place_joints(source: SourceModel, data: Any, given: Mapping[int, float], label: str) -> None:
    """Writes the values of a state into `data`, also those of followers. Raises `MmpError`."""
    model = source.model
    for joint, value in given.items():
        data.qpos[model.jnt_qposadr[joint]] = value
    followers = _followers(source, given)
    for _ in range(len(followers) + 1):  # a leader may follow another joint
        before = data.qpos.copy()
        for k, follower, leader in followers:
            data.qpos[model.jnt_qposadr[follower]] = _followed(model, data, k, follower, leader)
        if np.allclose(before, data.qpos, rtol=0, atol=TOLERANCE):
            break
    else:
        raise MmpError(f"{source.path}: joints follow one another in a circle")
    for joint, value in given.items():
        must = float(data.qpos[model.jnt_qposadr[joint]])
        if abs(must - value) > TOLERANCE:
            name = model.joint(joint).name
            raise MmpError(f"{label}: joint '{name}' is {value:g}; a constraint of the file makes it {must:g}")


def _followers(source: SourceModel, given: Mapping[int, float]) -> list[tuple[int, int, int]]:
    """Returns constraint, follower and leader (-1: none) of all couplings. Raises `MmpError` for closed loops."""
    model, out = source.model, []
    for k in np.flatnonzero(model.eq_active0):
        kind = int(model.eq_type[k])
        if kind == int(mujoco.mjtEq.mjEQ_JOINT):
            out.append((int(k), int(model.eq_obj1id[k]), int(model.eq_obj2id[k])))
        elif len(given) < model.njnt:
            name = model.eq(k).name or f"number {k}"
            raise MmpError(
                f"{source.path} has a closed loop: equality constraint {name} couples its joints; give every joint a"
                " value in --state"
            )
    for follower, leader in source.mimics.items():
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, follower)
        if joint not in given and joint not in [coupled for _, coupled, _ in out]:
            raise MmpError(f"{source.path}: joint '{follower}' mimics '{leader}'; give it a value in --state")
    return out


def _followed(model: Any, data: Any, k: int, follower: int, leader: int) -> float:
    """Returns the value of a follower, as MuJoCo defines it: a polynomial of the leader's, both from `qpos0`."""
    start, x = float(model.qpos0[model.jnt_qposadr[follower]]), 0.0
    if leader >= 0:
        at = model.jnt_qposadr[leader]
        x = float(data.qpos[at] - model.qpos0[at])
    return start + float(np.polynomial.polynomial.polyval(x, model.eq_data[k, :5]))
