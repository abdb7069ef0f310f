"""Constraints of the conflict tree, and the remaining safe intervals and departure times of edges."""

from dataclasses import dataclass

import numpy as np

from mmp_env.model.cell import Cell
from reference.clearance import Cloud, cloud, gaps
from reference.motion import along


@dataclass(frozen=True)
class BallConstraint:
    """Forbids max_j |q - center|_j <= radius [rad] during [begin, end] [s]."""

    center: np.ndarray
    radius: float
    begin: float
    end: float

    def is_broken(self, cell: Cell, arm_name, q):
        return bool(np.abs(np.asarray(q) - self.center).max() <= self.radius)


@dataclass(frozen=True)
class CloudConstraint:
    """Forbids moving spheres of parts >= `first_part` closer than `margin` to world spheres during [begin, end]."""

    centers: np.ndarray
    radii: np.ndarray
    margin: float
    first_part: int
    begin: float
    end: float

    def is_broken(self, cell: Cell, arm_name, q):
        own = cloud(cell, cell.arm(arm_name), q)
        own = own.only(own.parts >= max(self.first_part, 1))
        others = Cloud(np.zeros(len(self.radii), int), np.asarray(self.centers), np.asarray(self.radii))
        return bool((gaps(own, others) < self.margin).any())


def standing(cell: Cell, other_name, q_other, begin, end, margin, first_part=1):
    """Forbids coming closer than `margin` to the moving links of another arm as it stands at `q_other`."""
    other = cloud(cell, cell.arm(other_name), q_other).moving
    return CloudConstraint(other.centers, other.radii, margin, first_part, begin, end)


def merged(intervals):
    """Returns the same set of times as disjoint closed intervals in ascending order."""
    out = []
    for begin, end in sorted(intervals):
        if out and begin <= out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((begin, end))
    return out


def free_times(forbidden):
    """Returns [0, inf) minus closed intervals, as (begin, end) pairs."""
    out, begin = [], 0.0
    for lo, hi in merged(forbidden):
        if hi < 0:
            continue
        if lo > begin:
            out.append((begin, lo))
        begin = hi
    if np.isfinite(begin):
        out.append((begin, np.inf))
    return out


def safe_intervals(cell: Cell, arm_name, q, constraints):
    """Returns the times at which the arm may stand at q: [0, inf) minus the windows of broken constraints."""
    return free_times([(c.begin, c.end) for c in constraints if c.is_broken(cell, arm_name, q)])


def is_path_breaking(cell: Cell, arm_name, path, constraint, per_step):
    """Returns whether a path on the grid [k, dof] breaks a constraint at an instant strictly within its window.

    Windows are in steps here. The function tests `per_step` instants of each step. The arm stays at the end.
    """
    horizon = max(len(path) - 1, int(np.ceil(constraint.begin))) + 1
    for k in range(max(0, int(constraint.begin * per_step)), int(min(constraint.end, horizon) * per_step) + 1):
        t = k / per_step
        at = [np.interp(t, np.arange(len(path)), joint) for joint in np.transpose(path)]
        if constraint.begin < t < constraint.end and constraint.is_broken(cell, arm_name, at):
            return True
    return False


def forbidden_departures(cell: Cell, arm_name, q_from, q_to, duration, constraints, samples=400):
    """Returns the forbidden departure times of an edge that takes `duration` [s], by dense sampling.

    A constraint broken at the fraction s of the edge forbids departures in [begin - s duration, end - s duration].
    """
    out = []
    fractions = np.linspace(0, 1, samples + 1)
    for constraint in constraints:
        broken = [constraint.is_broken(cell, arm_name, q) for q in along(q_from, q_to, samples)]
        for k, s in enumerate(fractions):
            if broken[k]:
                # An edge that breaks the constraint at two neighbouring samples counts as breaking it between them.
                first = fractions[k - 1] if k > 0 and broken[k - 1] else s
                out.append((constraint.begin - s * duration, constraint.end - first * duration))
    return merged(out)


def earliest_departure(cell: Cell, arm_name, q_from, q_to, duration, constraints, window, samples=400):
    """Returns the first allowed departure in `window` = (earliest, latest), or None."""
    t = window[0]
    for begin, end in forbidden_departures(cell, arm_name, q_from, q_to, duration, constraints, samples):
        if begin <= t <= end:
            t = end
    return t if t <= window[1] else None
