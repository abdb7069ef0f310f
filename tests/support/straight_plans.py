"""Plans straight from state to state, valid or not, and states of whole cells."""

from itertools import pairwise

import numpy as np

from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem, velocity_limits

SPEED = 0.8
LEVEL = np.array([0.0, -0.2, 0.0, 0.0, 0.0, 0.0])
STEEP = np.array([0.0, -1.3, 0.0, 0.0, 0.0, 0.0])
FACING = np.pi * np.eye(6)[0]
"""Offset of joint 1 that turns a stretched-out UR5e of a ring towards the centre."""


def straight(cell, start, goal, *, via=(), speed=SPEED, moved=None):
    """Returns a plan of straight lines through the given states at `speed`. The plan may collide."""
    states = [start, *via, goal]
    moves = [max(np.abs(b[name] - a[name]).max() for name in a) for a, b in pairwise(states)]
    times = np.concatenate([[0.0], np.cumsum(np.maximum(np.array(moves) / speed, 0.1))])
    problem = Problem(
        cell=cell,
        start=start,
        goal=goal,
        max_velocity=velocity_limits(cell, speed),
        margins=Margins(arms=0.001, obstacles=0.001, self=0.001),
        name="made",
    )
    names = cell.arm_names if moved is None else moved
    return Plan(problem=problem, times=times, positions={a: np.array([s[a] for s in states]) for a in names})


def everyone(cell, pose):
    return {arm.name: np.array(getattr(arm.robot, pose)) for arm in cell.arms}


def elsewhere(cell):
    """Returns a state of tucked arms, turned about their first and last joints, without contacts."""
    turn = {arm.name: -0.6 * np.eye(arm.dof)[0] - 0.4 * np.eye(arm.dof)[-1] for arm in cell.arms}
    return {name: q + turn[name] for name, q in everyone(cell, "tucked").items()}
