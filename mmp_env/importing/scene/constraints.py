"""Refuses what a cell cannot represent: loops and couplings over arms, height fields and flexible bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mmp_env.errors import MmpError
from mmp_env.importing.scene.model_arms import ModelArm
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree

_EQUALITY, _WRAP, _SITE = mujoco.mjtEq, mujoco.mjtWrap, int(mujoco.mjtObj.mjOBJ_SITE)


def refuse_constraints(tree: ModelTree, arms: Sequence[ModelArm]) -> None:
    """Raises `MmpError` for an active constraint that couples a joint of an arm with anything else."""
    model, owner = tree.model, {joint: arm.name for arm in arms for joint in arm.joints}
    for k in range(model.neq):
        if not model.eq_active0[k]:
            continue
        kind, first, second = int(model.eq_type[k]), int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        name = model.eq(k).name or f"number {k}"
        if kind in (int(_EQUALITY.mjEQ_CONNECT), int(_EQUALITY.mjEQ_WELD)):
            is_site = int(model.eq_objtype[k]) == _SITE
            a, b = (int(model.site_bodyid[i]) if is_site else i for i in (first, second))
            if _moving(tree, a, owner) != _moving(tree, b, owner):
                raise MmpError(
                    f"the model has a closed loop: equality constraint {name} joins '{tree.body_name(a)}' and"
                    f" '{tree.body_name(b)}' over joints of an arm; an arm must be a serial chain"
                )
        elif kind == int(_EQUALITY.mjEQ_JOINT):
            for joint in (first, second):
                if joint in owner:
                    raise MmpError(
                        f"equality constraint {name} couples joint '{tree.joint_name(joint)}' of arm"
                        f" '{owner[joint]}'; the joints of an arm must move independently"
                    )
        elif kind == int(_EQUALITY.mjEQ_TENDON):
            for tendon in (first, second):
                _refuse_tendon(tree, tendon, owner, f"equality constraint {name}")
    for tendon in range(model.ntendon):
        if model.tendon_limited[tendon]:
            _refuse_tendon(tree, tendon, owner, "a limit")


def _moving(tree: ModelTree, body: int, owner: dict[int, str]) -> set[int]:
    return {joint for joint in tree.above(body) if joint in owner}


def _refuse_tendon(tree: ModelTree, tendon: int, owner: dict[int, str], cause: str) -> None:
    """Raises `MmpError` if a tendon that a constraint acts on runs over a joint of an arm."""
    if tendon < 0:
        return
    model, joints = tree.model, set()
    sets = []
    first = int(model.tendon_adr[tendon])
    for k in range(first, first + int(model.tendon_num[tendon])):
        kind, wrapped = int(model.wrap_type[k]), int(model.wrap_objid[k])
        if kind == int(_WRAP.mjWRAP_JOINT):
            joints.add(wrapped)
        elif kind in (int(_WRAP.mjWRAP_SITE), int(_WRAP.mjWRAP_SPHERE), int(_WRAP.mjWRAP_CYLINDER)):
            bodies = model.site_bodyid if kind == int(_WRAP.mjWRAP_SITE) else model.geom_bodyid
            sets.append(_moving(tree, int(bodies[wrapped]), owner))
    joints |= set().union(*sets) - (set.intersection(*sets) if sets else set())
    crossed = sorted(joint for joint in joints if joint in owner)
    if crossed:
        name = model.tendon(tendon).name or f"number {tendon}"
        raise MmpError(
            f"{cause} of tendon {name} acts on joint '{tree.joint_name(crossed[0])}' of arm '{owner[crossed[0]]}'; the"
            " joints of an arm must move independently"
        )


def refuse_shapes(tree: ModelTree, collides: Any) -> None:
    """Raises `MmpError` for colliding geometry that no convex solid can stand for.

    Args:
        tree: The model.
        collides: Whether each geom collides with any other.
    """
    model = tree.model
    if model.nflex:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, 0) or "number 0"
        raise MmpError(f"the model has the flexible body {name}; a cell has rigid bodies only")
    strange = {
        int(mujoco.mjtGeom.mjGEOM_HFIELD): "a height field",
        int(mujoco.mjtGeom.mjGEOM_SDF): "a signed distance field",
    }
    for geom, kind in enumerate(model.geom_type.tolist()):
        if collides[geom] and kind in strange:
            raise MmpError(f"geom '{tree.geom_names[geom]}' is {strange[kind]}, which a cell cannot represent")
