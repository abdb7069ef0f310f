"""Finds constraint kinds by the names that planner options use."""

from __future__ import annotations

import math

from mmp_env.errors import MmpError, UnknownNameError
from mmp_planners.conflict_tree.constraints.avoid_path import AvoidPath
from mmp_planners.conflict_tree.constraints.avoid_state import AvoidState
from mmp_planners.conflict_tree.constraints.kind import ConstraintKind, EitherArm
from mmp_planners.conflict_tree.constraints.priority import PathPriority, StepPriority
from mmp_planners.conflict_tree.constraints.sphere import Sphere
from mmp_planners.conflict_tree.constraints.split import Split
from mmp_planners.conflict_tree.constraints.vertex import Vertex

KINDS = ("avoid-state", "vertex", "avoid-path", "sphere", "priority", "priority-path", "split")


def constraint_kind(name: str, *, pad: float, radius: float = 0.2, sphere_radius: float = 0.1) -> ConstraintKind:
    """Returns the constraint kind of a name.

    Args:
        name: one of `KINDS`.
        pad: time [s] that `avoid-state` reaches beyond the conflict.
        radius: radius [rad] of `vertex`.
        sphere_radius: radius [m] of `sphere`.

    Raises:
        UnknownNameError: if there is no such kind.
    """
    one_sided = {
        "avoid-state": AvoidState(pad=pad),
        "vertex": Vertex(radius=radius),
        "avoid-path": AvoidPath(),
        "sphere": Sphere(radius=sphere_radius),
        "priority": StepPriority(),
        "priority-path": PathPriority(),
    }
    if name == "split":
        return Split()
    if name not in one_sided:
        raise UnknownNameError("constraint kind", name, KINDS)
    return EitherArm(kind=one_sided[name])


def constraint_kinds(names: str, *, pad: float) -> tuple[ConstraintKind, ...]:
    """Returns several kinds, their names joined by `+`; a number after `sphere-` or `vertex-` is its radius.

    Raises:
        MmpError: if a kind does not exist or is named twice, or if a radius is not a positive number.
    """
    parts = names.split("+")
    if len(set(parts)) < len(parts):
        raise MmpError(f"constraint kinds '{names}' name one kind twice")
    return tuple(_with_radius(part, pad) for part in parts)


def _with_radius(name: str, pad: float) -> ConstraintKind:
    base, _, number = name.partition("-")
    if base not in ("sphere", "vertex") or not number:
        return constraint_kind(name, pad=pad)
    try:
        radius = float(number)
    except ValueError:
        radius = math.nan
    if not (math.isfinite(radius) and radius > 0):
        raise MmpError(f"constraint kind '{name}': the radius must be a positive number")
    return constraint_kind(base, pad=pad, radius=radius, sphere_radius=radius)
