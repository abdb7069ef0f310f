"""Refusals of models whose chain of joints is no arm: joints of other types, missing limits, closed loops."""

from __future__ import annotations

from collections.abc import Sequence

from mmp_env.errors import MmpError
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.kinematic_tree import HINGE, SLIDE, KinematicTree
from mmp_env.mujoco_import import mujoco


def refuse_odd_joints(source: SourceModel, joints: Sequence[int]) -> None:
    """Raises `MmpError` where a joint of the chain has no limits, an empty range, or another type beside it."""
    model = source.model
    for j in joints:
        name, kind = model.joint(j).name, int(model.jnt_type[j])
        if kind == SLIDE and not model.jnt_limited[j]:
            raise MmpError(f"{source.path}: slide joint '{name}' has no limits; give it a range")
        lower, upper = model.jnt_range[j]
        if lower > upper or (model.jnt_limited[j] and lower == upper):
            raise MmpError(
                f"{source.path}: joint '{name}' has the range from {lower:g} to {upper:g}; the lower limit must be the"
                " smaller one"
            )
        body = int(model.jnt_bodyid[j])
        others = range(int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body]))
        if any(int(model.jnt_type[o]) not in (HINGE, SLIDE) for o in others):
            raise MmpError(f"{source.path}: body '{model.body(body).name}' has a ball or free joint beside '{name}'")
    first, last = int(model.jnt_bodyid[joints[0]]), int(model.jnt_bodyid[joints[-1]])
    while last != first:
        for o in range(int(model.body_jntadr[last]), int(model.body_jntadr[last]) + int(model.body_jntnum[last])):
            if int(model.jnt_type[o]) not in (HINGE, SLIDE):
                raise MmpError(
                    f"{source.path}: joint '{model.joint(o).name}' in the chain is a ball joint; an arm has hinge and"
                    " slide joints"
                )
        last = int(model.body_parentid[last])


def refuse_loops(source: SourceModel, tree: KinematicTree, joints: Sequence[int]) -> None:
    """Raises `MmpError` where a constraint closes a loop over a joint of the chain."""
    model, used = source.model, set(joints)

    def moved(body: int) -> set[int]:
        return set(tree.joints_between(None, body)) & used

    for k in range(model.neq):
        kind, first, second = int(model.eq_type[k]), int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        name = model.eq(k).name or f"number {k}"
        if kind in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
            is_site = int(model.eq_objtype[k]) == int(mujoco.mjtObj.mjOBJ_SITE)
            a, b = (int(model.site_bodyid[i]) if is_site else i for i in (first, second))
            if moved(a) != moved(b):
                raise MmpError(
                    f"{source.path} has a closed loop: equality constraint {name} joins '{model.body(a).name}' and"
                    f" '{model.body(b).name}'; an arm must be a serial chain"
                )
        elif kind == int(mujoco.mjtEq.mjEQ_JOINT) and {first, second} & used and second >= 0:
            raise MmpError(
                f"{source.path}: equality constraint {name} makes joint '{model.joint(first).name}' follow"
                f" '{model.joint(second).name}'; the joints of an arm must move independently"
            )
    names = {model.joint(joint).name for joint in joints}
    for follower, leader in source.mimics.items():
        if leader in names or follower in names:
            raise MmpError(
                f"{source.path}: joint '{follower}' mimics '{leader}'; the joints of an arm must move independently"
            )
