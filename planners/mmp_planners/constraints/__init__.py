"""Constraint kinds: what the branches of a conflict forbid. One file each; `KINDS` names them."""

from mmp_planners.constraints.avoid_path import AvoidPath
from mmp_planners.constraints.avoid_state import AvoidState
from mmp_planners.constraints.kind import INSTANTS, Branch, ConstraintKind, EitherArm, EveryKind, Meeting, OneSided
from mmp_planners.constraints.priority import PathPriority, StepPriority
from mmp_planners.constraints.sphere import Sphere
from mmp_planners.constraints.split import Split
from mmp_planners.constraints.vertex import Vertex

__all__ = [
    "INSTANTS",
    "AvoidPath",
    "AvoidState",
    "Branch",
    "ConstraintKind",
    "EitherArm",
    "EveryKind",
    "Meeting",
    "OneSided",
    "PathPriority",
    "Sphere",
    "Split",
    "StepPriority",
    "Vertex",
]
