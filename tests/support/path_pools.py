"""Path pools of two arms: straight paths, paths lifted over everything, and mutually blocking paths."""

import numpy as np
from support import two_arms
from support.two_arms import along

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR

DT_S = 0.1
LIFT = np.array([0.0, -0.9, -0.6, 0.0, 0.0, 0.0])
NO_END = float("inf")


def path_pool(problem, *paths):
    """Returns a pool with `paths`; each item has one path per arm."""
    names = problem.cell.arm_names
    speeds = [problem.max_velocity[name] * DT_S for name in names]
    out = core.PathRecombination(
        problem.cell.collision.core, speeds, problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
    )
    for path in paths:
        out.add(path)
    return out


def run(paths, limit=NO_END):
    return paths.recombine(limit, core.Clock(NO_END))


def straight(problem):
    return [
        along(problem.max_velocity[name][0] * DT_S, problem.start[name], problem.goal[name])
        for name in problem.cell.arm_names
    ]


def through(problem, offset):
    """Returns paths: the left arm passes a point `offset` [rad] from halfway, the right arm goes straight."""
    start, goal, right = problem.start["left"], problem.goal["left"], straight(problem)[1]
    return [along(problem.max_velocity["left"][0] * DT_S, start, (start + goal) / 2 + offset, goal), right]


def lifted(problem, height=1.0):
    """Returns paths on which the left arm lifts its hand over everything."""
    return through(problem, height * LIFT)


def with_a_twist(problem, turn):
    """Returns paths on which the left arm turns its hand and back, a useless detour."""
    return through(problem, turn * np.eye(6)[5])


def mutually_blocking():
    """Returns a problem in which each arm blocks the other at its goal, so neither can arrive first."""
    return two_arms.turning((-1.0, 0.3), (-1.0, 0.3))
