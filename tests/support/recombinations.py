"""Ways of two arms for the core to put together: straight, lifted over everything, and ways that shut each other in."""

import numpy as np
from support import two_arms
from support.two_arms import along

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR

DT_S = 0.1
LIFT = np.array([0.0, -0.9, -0.6, 0.0, 0.0, 0.0])
NO_END = float("inf")


def recombination(problem, *ways):
    """With `ways`, each of them one for every arm, added."""
    names = problem.cell.arm_names
    speeds = [problem.max_velocity[name] * DT_S for name in names]
    out = core.PathRecombination(
        problem.cell.collision.core, speeds, problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
    )
    for way in ways:
        out.add(way)
    return out


def run(ways, limit=NO_END):
    return ways.recombine(limit, core.Clock(NO_END))


def straight(problem):
    return [
        along(problem.max_velocity[name][0] * DT_S, problem.start[name], problem.goal[name])
        for name in problem.cell.arm_names
    ]


def by_way_of(problem, offset):
    """The left arm goes by way of a place that is so far [rad] from halfway; the right one goes straight."""
    start, goal, right = problem.start["left"], problem.goal["left"], straight(problem)[1]
    return [along(problem.max_velocity["left"][0] * DT_S, start, (start + goal) / 2 + offset, goal), right]


def lifted(problem, height=1.0):
    """The left arm lifts its hand over everything."""
    return by_way_of(problem, height * LIFT)


def with_a_twist(problem, turn):
    """The left arm turns its hand and back, which helps nobody."""
    return by_way_of(problem, turn * np.eye(6)[5])


def shut_in():
    """Each arm's goal is in the way of the other one, so that neither may come first."""
    return two_arms.turning((-1.0, 0.3), (-1.0, 0.3))
