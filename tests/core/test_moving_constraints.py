"""Constraints that move: another arm along its trajectory, as in planning against fixed paths."""

import numpy as np
import pytest

from mmp_env import core
from mmp_env.model.rings import ring_cell

MARGIN, PROOF, STEP_RAD = 0.002, 0.0015, 0.08


@pytest.fixture(scope="module")
def cell():
    return ring_cell(2)


@pytest.fixture(scope="module")
def crossing(cell):
    """Returns a path in which arm1 sweeps its whole reach past the centre and stops."""
    robot = cell.arms[1].robot
    start, goal = np.array(robot.home), np.array(robot.home)
    start[0] -= 1.4
    goal[0] += 1.4
    steps = int(np.ceil(np.abs(goal - start).max() / STEP_RAD))
    return cell.collision.motion("arm1", start + np.linspace(0, 1, steps + 1)[:, None] * (goal - start)), start, goal


def states_near_the_centre(cell, count, seed=0):
    rng = np.random.default_rng(seed)
    home = cell.arms[0].robot.home
    q = home + rng.uniform(-1.2, 1.2, (count, 6))
    return q[cell.collision.is_free("arm0", q, margin=MARGIN)]


def test_safe_intervals_leave_out_every_instant_at_which_the_moving_arm_touches(cell, crossing):
    motion, start, goal = crossing
    parts = core.Constraint.moving(motion, 0, core.FOREVER)
    instants = np.linspace(0, motion.last, 20 * motion.last + 1)
    other = start + (instants / motion.last)[:, None] * (goal - start)
    touched = 0
    for q in states_near_the_centre(cell, 60):
        intervals = core.safe_intervals(cell.collision.core, 0, q, parts, core.Levels(MARGIN, PROOF))
        near = cell.collision.pair_clearance("arm0", np.repeat(q[None], len(other), 0), "arm1", other) < PROOF - 1e-5
        touched += near.any()
        for at in instants[near]:
            assert not any(lo <= at <= hi for lo, hi in intervals)
        if not near.any() and cell.collision.pair_clearance("arm0", q[None], "arm1", goal[None])[0] > 0.2:
            assert intervals[-1][1] == core.FOREVER
    assert touched > 5


def test_a_path_planned_against_a_moving_arm_is_free_of_conflicts_with_it(cell, crossing):
    motion, _, _ = crossing
    parts = core.Constraint.moving(motion, 0, core.FOREVER)
    home = np.array(cell.arms[0].robot.home)
    start, goal = home.copy(), home.copy()
    start[0] += 1.2
    goal[0] -= 1.2
    max_step = np.full(6, STEP_RAD)
    planner = core.SingleArm(
        cell.collision.core,
        0,
        start=start,
        goals=goal[None],
        max_step=max_step,
        levels=core.Levels(MARGIN, PROOF),
        seed=0,
    )
    alone, _ = planner.plan([], 1, core.Clock(20.0))
    against, _ = planner.plan(parts, 1, core.Clock(20.0))
    assert alone is not None
    assert against is not None

    def conflicts(q):
        return cell.collision.conflict_instants(
            [cell.collision.motion("arm0", q), motion], [(0, 1)], core.Levels(PROOF, 0.6 * PROOF)
        )[0]

    assert len(conflicts(alone))
    assert not len(conflicts(against))
