"""Finds the arms of a compiled MuJoCo model, and refuses joints that an arm cannot have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.names import NAMES, is_name
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import SLIDE, ModelTree

_SEPARATORS = re.compile(r"[/_.\-: ]")


@dataclass(frozen=True, kw_only=True)
class ModelArm:
    """An arm of a model: its joints from the base on, and the prefix that all their names have."""

    name: str
    joints: tuple[int, ...]
    prefix: str


def find_arms(tree: ModelTree, asked: Mapping[str, str | Sequence[str]] | None) -> list[ModelArm]:
    """Returns the arms of a model.

    Args:
        tree: The model.
        asked: Arm name -> the names of its joints, or a prefix of their names. None: all chains that are at least half
            as long as the longest one.

    Raises:
        MmpError: if there is no arm, if a name is unknown, or if the joints are no serial chain.
    """
    if asked is None:
        arms = _all_arms(tree)
    else:
        arms = [_arm(tree, name, joints) for name, joints in _asked_arms(tree, asked).items()]
    if not arms:
        raise MmpError("the model has no arm: no hinge or slide joint was found or asked for")
    _refuse_shared_joints(tree, arms)
    for arm in arms:
        _refuse_odd_joints(tree, arm)
    return arms


def _all_arms(tree: ModelTree) -> list[ModelArm]:
    chains = tree.chains(_usable(tree))
    longest = max(map(len, chains), default=0)
    arms: list[ModelArm] = []
    for joints in chains:
        if len(joints) < longest / 2 or len(joints) < min(2, longest):
            continue
        prefix = _common_prefix([tree.model.joint(j).name for j in joints])
        first = int(tree.model.jnt_bodyid[joints[0]])
        spoken = [_SEPARATORS.sub("_", text).strip("_") for text in (prefix, tree.model.body(first).name)]
        free = [name for name in spoken if is_name(name) and name not in ("obstacle", *(arm.name for arm in arms))]
        arms.append(_arm(tree, free[0] if free else f"arm{len(arms)}", joints))
    return arms


def _arm(tree: ModelTree, name: str, joints: Sequence[int]) -> ModelArm:
    prefix = _common_prefix([tree.model.joint(joint).name for joint in joints])
    return ModelArm(name=name, joints=tuple(joints), prefix=prefix)


def _asked_arms(tree: ModelTree, asked: Mapping[str, str | Sequence[str]]) -> dict[str, tuple[int, ...]]:
    """Returns arm name -> joints."""
    if not isinstance(asked, Mapping):
        raise MmpError("arms is no mapping; it must be arm name -> joint names, or a prefix of joint names")
    out = {}
    for name, joints in asked.items():
        if not (isinstance(name, str) and is_name(name)):
            raise MmpError(f"an arm is called {name!r}; its name must be {NAMES}")
        if isinstance(joints, str):
            out[name] = _by_prefix(tree, joints)
        elif isinstance(joints, Sequence) and all(isinstance(joint, str) for joint in joints):
            out[name] = _by_names(tree, name, joints)
        else:
            raise MmpError(f"arm '{name}' has {joints!r}; give a list of joint names, or a prefix of them")
    return out


def _by_prefix(tree: ModelTree, prefix: str) -> tuple[int, ...]:
    usable = _usable(tree)
    chains = tree.chains(lambda joint: tree.model.joint(joint).name.startswith(prefix) and usable(joint))
    if not chains:
        raise UnknownNameError("joint prefix", prefix, _prefixes(tree))
    longest = max(map(len, chains))
    long = [chain for chain in chains if len(chain) >= max(longest / 2, min(2, longest))]
    if len(long) > 1:
        begins = ", ".join(f"{tree.joint_name(chain[0])} ..." for chain in long)
        raise MmpError(
            f"joint prefix '{prefix}' begins the joints of {len(long)} arms: {begins}; give a longer prefix, or a list"
            " of names"
        )
    return tuple(long[0])


def _by_names(tree: ModelTree, arm: str, names: Iterable[str]) -> tuple[int, ...]:
    known = {tree.joint_name(j): j for j in range(tree.model.njnt)}
    out: list[int] = []
    for name in names:
        if name not in known:
            raise MmpError(f"arm '{arm}': {UnknownNameError('joint', str(name), known)}")
        if not tree.is_hinge_or_slide(known[name]):
            kind = mujoco.mjtJoint(int(tree.model.jnt_type[known[name]])).name.removeprefix("mjJNT_").lower()
            raise MmpError(f"arm '{arm}': joint '{name}' is a {kind} joint; an arm has hinge and slide joints")
        out.append(known[name])
    if not out:
        raise MmpError(f"arm '{arm}' has no joints; give their names, or a prefix of them")
    chain = [j for j in tree.above(int(tree.model.jnt_bodyid[out[-1]])) if j in out]
    if chain != out:
        raise MmpError(
            f"arm '{arm}': its joints {', '.join(map(str, names))} are no serial chain; give each joint once, those of"
            " one chain, from the base to the tip"
        )
    return tuple(out)


def _usable(tree: ModelTree):
    followers = set()
    for k in range(tree.model.neq):
        if int(tree.model.eq_type[k]) == int(mujoco.mjtEq.mjEQ_JOINT) and tree.model.eq_obj2id[k] >= 0:
            followers.add(int(tree.model.eq_obj1id[k]))
    return lambda joint: tree.is_hinge_or_slide(joint) and joint not in followers


def _prefixes(tree: ModelTree) -> list[str]:
    """Returns the prefixes of joint names up to each separator, which are what a user may have meant."""
    names = [tree.model.joint(j).name for j in range(tree.model.njnt)]
    cuts = {name[: match.end()] for name in names for match in _SEPARATORS.finditer(name)}
    return sorted(cuts) or names


def _common_prefix(names: Sequence[str]) -> str:
    """Returns what all names begin with, up to a separator."""
    first, last = min(names), max(names)  # what these two begin with, all names between them begin with
    length = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    common = first[:length]
    ends = [match.end() for match in _SEPARATORS.finditer(common)]
    return common[: ends[-1]] if ends else ""


def _refuse_shared_joints(tree: ModelTree, arms: Sequence[ModelArm]) -> None:
    owner: dict[int, str] = {}
    for arm in arms:
        for joint in arm.joints:
            if joint in owner:
                raise MmpError(
                    f"joint '{tree.joint_name(joint)}' belongs to the arms '{owner[joint]}' and '{arm.name}'; leave it"
                    " out of both, and it is held"
                )
            owner[joint] = arm.name
    for arm in arms:
        for joint in tree.above(int(tree.model.jnt_bodyid[arm.joints[-1]])):
            if owner.get(joint, arm.name) != arm.name:
                raise MmpError(
                    f"joint '{tree.joint_name(joint)}' of arm '{owner[joint]}' moves arm '{arm.name}' as well; an arm"
                    " must not carry another one"
                )


def _refuse_odd_joints(tree: ModelTree, arm: ModelArm) -> None:
    model = tree.model
    for j in arm.joints:
        limited, (lower, upper) = bool(model.jnt_limited[j]), model.jnt_range[j]
        if int(model.jnt_type[j]) == SLIDE and not limited:
            raise MmpError(f"arm '{arm.name}': slide joint '{tree.joint_name(j)}' has no limits; give it a range")
        if limited and not lower < upper:
            raise MmpError(f"arm '{arm.name}': joint '{tree.joint_name(j)}' has an empty range")
    between = tree.above(int(model.jnt_bodyid[arm.joints[-1]]))
    for j in between[between.index(arm.joints[0]) :]:
        if not tree.is_hinge_or_slide(j):
            raise MmpError(
                f"arm '{arm.name}': joint '{tree.joint_name(j)}' in its chain is a ball joint; an arm has hinge and"
                " slide joints"
            )
