"""Constraint kinds: what the branches of a conflict forbid, one file each. `named.py` finds them by name."""

from mmp_planners.conflict_tree.constraints.avoid_path import AvoidPath
from mmp_planners.conflict_tree.constraints.avoid_state import AvoidState
from mmp_planners.conflict_tree.constraints.kind import (
    INSTANTS,
    Branch,
    ConflictInterval,
    ConstraintKind,
    EitherArm,
    EveryKind,
    OneSided,
)
from mmp_planners.conflict_tree.constraints.priority import PathPriority, StepPriority
from mmp_planners.conflict_tree.constraints.sphere import Sphere
from mmp_planners.conflict_tree.constraints.split import Split
from mmp_planners.conflict_tree.constraints.vertex import Vertex

__all__ = [
    "INSTANTS",
    "AvoidPath",
    "AvoidState",
    "Branch",
    "ConflictInterval",
    "ConstraintKind",
    "EitherArm",
    "EveryKind",
    "OneSided",
    "PathPriority",
    "Sphere",
    "Split",
    "StepPriority",
    "Vertex",
]
