"""Arms on a line with given paths: a planning context for the conflict tree without geometry."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from reference import toys

from mmp_env import core
from mmp_env.events import ignore
from mmp_env.model.certificate import Certificate
from mmp_env.model.margins import Margins
from mmp_env.problems.making import make_problem
from mmp_planners.conflict_tree.constraints import EitherArm, OneSided
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modified
from mmp_planners.conflict_tree.search import ConflictTree
from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.planner import StopPlanning
from mmp_planners.planning_context import Path, PlanningContext

_CELL = toys.toy_cell(toys.toy_arm("toy", [0, 0, 0]))
_PROBLEM = make_problem(_CELL, {"toy": [0.0, 0.5]}, {"toy": [0.0, 0.5]})
_MOTION = _CELL.collision.motion("toy", np.zeros((1, 2)))


def _all(clearance: float) -> Margins:
    return Margins(arms=clearance, obstacles=clearance, self=clearance)


def proof(clearance: float) -> Certificate:
    """Returns a certificate of a plan that keeps the clearance [m]."""
    return Certificate(valid=True, proved=_all(clearance), arms=(0, -1), instant=0.0)


def refusal(*arms: int, instant: float) -> Certificate:
    """Returns a failed certificate: the arms touch there, or one arm alone (the second is -1) touches a body."""
    return Certificate(valid=False, proved=_all(-0.1), arms=(arms[0], arms[1]), instant=instant)


PROVED = proof(0.01)
"""Default certificate."""

# Arms a and b swap places and conflict at place 1. Arm a has a detour by -5, which costs 12 instead of 2.
CROSSING = ([(0, 1, 2), (0, -5, 2)], [(2, 1, 0)])
# As above, but after its third constraint b has a cheap path too.
LATER = (
    lambda count: (0, 1, 2) if count == 0 else (0, -5, 2),
    lambda count: (2, 1, 0) if count < 3 else (2, 1.5, 0.5, 0),
)


def endless(count):
    """Returns a path for any number of constraints. Two arms with it are in conflict from its first step on."""
    return (0, 1)


def path(*places: float) -> Path:
    """Returns a path through places, one a step; its cost is the distance between them."""
    q = np.array(places, dtype=float)[:, None]
    return Path(q=q, motion=_MOTION, length=float(np.abs(np.diff(q, axis=0)).sum()))


def conflicts(paths: Sequence[Path], pairs: Sequence[tuple[int, int]]) -> dict[tuple[int, int], np.ndarray]:
    """Returns the steps at which two arms are at the same place. Arms stay at the ends of their paths."""
    found = {}
    for a, b in pairs:
        steps = range(max(paths[a].last, paths[b].last) + 1)
        same = [k for k in steps if paths[a].at(k) == paths[b].at(k)]
        if same:
            found[a, b] = np.array(same, dtype=float)
    return found


def node(number: int, *places: Sequence[float], bounds: Sequence[float] | None = None) -> Node:
    """Returns a node with one path per arm. The default `bounds` [rad] are the lengths of the paths."""
    paths = tuple(path(*row) for row in places)
    pairs = [(a, b) for a in range(len(paths)) for b in range(a + 1, len(paths))]
    return Node(
        id=number,
        parent=None,
        paths=paths,
        constraints=tuple(() for _ in paths),
        bounds=tuple(bounds) if bounds else tuple(p.length for p in paths),
        conflicts=conflicts(paths, pairs),
    )


class ArmsOnALine(PlanningContext):
    """`places[arm](n)` are the places of an arm with n constraints, None if it has no path.

    A sequence may stand for a function: beyond its end there is no path. The first plans get the `certificates`.
    """

    def __init__(self, *places: Sequence | Callable, certificates: Sequence[Certificate] = ()) -> None:
        self.problem, self.names, self.dt, self.clock = (
            _PROBLEM,
            tuple("abcdef"[: len(places)]),
            0.1,
            core.Clock(math.inf),
        )
        self.max_step = [np.full(1, 100.0) for _ in places]
        self.certificates = list(certificates)
        self.seeds: list[int] = []
        self.calls: list[tuple[int, int, int, float]] = []  # arm, how many constraints, seed, budget
        self.experiences: list[np.ndarray | None] = []
        self._places = places

    def reseed(self, seed):
        self.seeds.append(seed)

    def low_level(self, arm, constraints, seed, budget=1.0, others=(), experience=None):
        count, rows = len(constraints), self._places[arm]
        self.calls.append((arm, count, seed, budget))
        self.experiences.append(experience)
        places = rows(count) if callable(rows) else rows[count] if count < len(rows) else None
        return (None if places is None else path(*places)), 1

    def conflicts(self, paths, pairs):
        return conflicts(paths, pairs)

    def may_be_near(self, path, other, distance):
        gap = max(path.q.min() - other.q.max(), other.q.min() - path.q.max())
        return gap < distance

    def certify(self, plan):
        return self.certificates.pop(0) if self.certificates else PROVED


@dataclass
class OneConstraint:
    """Always returns the same constraint, and records its calls: (conflict interval, arm, instant)."""

    asked: list[tuple] = field(default_factory=list)

    def forbid(self, context, paths, interval, arm, instant):
        self.asked.append((interval, arm, instant))
        return [core.Constraint.ball(np.zeros(1), 0.1, 0, 1)]

    def describe(self, context, interval, arm):
        return f"{context.names[arm]} does something else"


@dataclass
class Push:
    """A modification that moves arm k to the places `to[k]`, and changes no other arm."""

    to: dict[int, Sequence[float]]

    def __call__(self, context, paths, arm, constraints):
        return Modified(path=path(*self.to[arm]), iterations=1) if arm in self.to else None


def tree(
    context: ArmsOnALine, *, w: float = 1.0, watch: Callable = ignore, branching: OneSided | None = None, **parts
) -> ConflictTree:
    """Returns the search of plain ECBS without restarts; `parts` replace parts of it."""
    plain = {"selection": Focal(w=w), "branching": EitherArm(kind=branching or OneConstraint()), "restarts": False}
    return ConflictTree(context=context, emitter=EventEmitter(watch, context), **(plain | parts))


def ended(search: ConflictTree, seed: int = 0) -> bool:
    """Runs a search. Returns whether it was exhausted; False if its watcher stopped it."""
    try:
        return search.run(seed)
    except StopPlanning:
        return False


def emitted(run, seed=0):
    """Returns a search, whether it was exhausted, and its events. `run` makes the search from a watcher."""
    events = []
    search = run(events.append)
    return search, ended(search, seed), events
