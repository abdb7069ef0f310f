"""Plans of two UR5e with random corners, out of each other's reach, and the rates of motions."""

from __future__ import annotations

import itertools

import numpy as np
from support import two_arms

from mmp_env.model.plan import Plan
from mmp_env.problems.making import make_problem

APART_M = 2.5


def cornered_plan(seed, corners, *, turn=0.4, max_velocity=0.8):
    """Returns a plan in which all joints move by up to `turn` [rad] about a pose in which the arms touch nothing."""
    rng = np.random.default_rng(seed)
    cell = two_arms.facing_cell(APART_M)
    rows = {
        name: two_arms.reaching(0.0) + rng.uniform(-turn, turn, (corners + 2, 6)) * (1, 0.5, 0.5, 1, 1, 1)
        for name in cell.arm_names
    }
    start, goal = ({name: q[k] for name, q in rows.items()} for k in (0, -1))
    return plan_through(make_problem(cell, start, goal, max_velocity=max_velocity), rows)


def plan_through(problem, rows):
    """Returns a plan of straight lines through `rows`, arm -> [k, dof], at the velocity limits."""
    lasting = [np.abs(np.diff(q, axis=0)) / problem.max_velocity[name] for name, q in rows.items()]
    times = np.concatenate([[0.0], np.cumsum(np.maximum(np.max([part.max(axis=1) for part in lasting], axis=0), 1e-3))])
    return Plan(problem=problem, times=times, positions=rows)


def side_by_side(plan, values):
    """Returns the joints of all arms in one array."""
    return np.concatenate([np.asarray(values[name]) for name in plan.problem.cell.arm_names], axis=-1)


def largest_shares(plan):
    """Returns the largest shares of the velocity, acceleration and jerk limits, by differences of the positions."""
    q, step = side_by_side(plan, plan.positions), plan.times[1] - plan.times[0]
    rate, out = np.pad(q, ((3, 3), (0, 0)), mode="edge"), []
    for limits in (plan.problem.max_velocity, plan.max_acceleration, plan.max_jerk):
        rate = np.diff(rate, axis=0) / step
        out.append(float((np.abs(rate) / side_by_side(plan, limits)).max()))
    return out


def distance_to_lines(q, corners):
    """Returns the distance [t] of each row of `q` [t, n] from the lines through `corners` [k, n], in the max norm.

    It is an upper bound, because it takes the nearest point in the Euclidean norm.
    """
    least = np.full(len(q), np.inf)
    for a, b in itertools.pairwise(corners):
        line = b - a
        share = np.clip((q - a) @ line / (line @ line), 0.0, 1.0)
        least = np.minimum(least, np.abs(q - a - share[:, None] * line).max(axis=1))
    return least
