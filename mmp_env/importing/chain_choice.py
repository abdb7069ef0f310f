"""Chooses the serial chain of a compiled model that is the arm: its base, its joints and its end."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_env.errors import MmpError
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.kinematic_tree import KinematicTree
from mmp_env.importing.model_refusals import refuse_loops, refuse_odd_joints


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainOptions:
    """Options of the choice, by names in the model: where the chain begins and ends, and which joints it may have."""

    root: str | None = None
    tip: str | None = None
    tool: str | None = None
    prefix: str | None = None


@dataclass(frozen=True, kw_only=True)
class ChainChoice:
    """Numbers of bodies, joints and sites in a compiled model that make an arm.

    `tip` and `tip_site` are None where the end of the arm is found by its name. `prefix` is left out of joint names.
    `other_bodies` are bodies that hang on the root and belong to another arm, with all that hangs on them.
    """

    root: int
    joints: tuple[int, ...]
    tip: int | None = None
    tip_site: int | None = None
    prefix: str = ""
    other_bodies: frozenset[int] = frozenset()


def choose_chain(source: SourceModel, options: ChainOptions) -> ChainChoice:
    """Returns the chain of hinge and slide joints from the root to the tip, the longest without these options.

    Raises:
        MmpError: if there is no joint, if a name is unknown, or if the chain holds what an arm cannot have.
    """
    tree = KinematicTree(source, options.prefix)
    root = tree.body(options.root, "--root") if options.root else None
    site = None
    if options.tip:
        tip, site = tree.body_or_site(options.tip)
    else:
        tip = tree.longest_tip(root)
    joints = tree.joints_between(root, tip)
    if not joints:
        where = f" between '{options.root or 'world'}' and '{options.tip}'" if options.tip else ""
        raise MmpError(f"{source.path} has no hinge or slide joint{where}; an arm needs at least one")
    refuse_odd_joints(source, joints)
    refuse_loops(source, tree, joints)
    if root is None:
        root = tree.first_ancestor(int(source.model.jnt_bodyid[joints[0]]))
    if options.tool:
        tip, site = tree.body(options.tool, "--tool"), None
        if tree.joints_between(root, tip)[: len(joints)] != joints:
            raise MmpError(f"--tool {options.tool} does not hang on the last link; its joints are not the arm's")
    return ChainChoice(
        root=root,
        joints=tuple(joints),
        tip=tip if options.tip or options.tool else None,
        tip_site=site,
        prefix=options.prefix or "",
    )
