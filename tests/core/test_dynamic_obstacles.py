"""Dynamic obstacles in planning and in safe intervals, against distances at many instants. Times are in steps."""

import gc

import numpy as np
import pytest
from reference import clearance

from mmp_env import core
from mmp_env.model.rings import ring_cell

MARGIN_M, PROOF_M, STEP_RAD = 0.002, 0.0015, 0.08
LEVELS = core.Levels(MARGIN_M, PROOF_M)
FLOAT_M = 1e-5


@pytest.fixture(scope="module")
def cell():
    return ring_cell(2)


def sweep(cell, arm, turn, wait=0, far=1.3):
    """Returns a path that waits, turns about the base from `far` on one side to the other, and stops: [k, dof]."""
    home = np.array(cell.arm(arm).robot.home)
    start, goal = home.copy(), home.copy()
    start[0] -= turn * far
    goal[0] += turn * far
    steps = int(np.ceil(2 * far / STEP_RAD))
    moving = start + np.linspace(0, 1, steps + 1)[:, None] * (goal - start)
    return np.vstack([np.repeat(start[None], wait, axis=0), moving])


def gap(cell, path_a, path_b, t):
    """Returns the clearance of the arms' moving parts at an instant. Both arms stay at their last rows."""
    a, b = ([np.interp(t, np.arange(len(path)), joint) for joint in np.transpose(path)] for path in (path_a, path_b))
    return clearance.moving_clearance(cell, "arm0", a, "arm1", b)


def single_arm(cell, path, seed=0):
    step = np.full(path.shape[1], STEP_RAD)
    return core.SingleArm(
        cell.collision.core, 0, start=path[0], goals=path[-1:], max_step=step, levels=LEVELS, seed=seed
    )


def states_near_the_centre(cell, count, seed=0):
    rng = np.random.default_rng(seed)
    q = np.array(cell.arms[0].robot.home) + rng.uniform(-1.2, 1.2, (count, 6))
    return q[cell.collision.is_free("arm0", q, margin=MARGIN_M)]


def test_a_stay_is_safe_exactly_where_no_arm_comes_near(cell):
    """Safe intervals are never unsafe, and cautious by at most the chord deviation of a step, about 3 cm."""
    other = sweep(cell, "arm1", 1, wait=5)
    moving = cell.collision.motion("arm1", other)
    touched = passed = 0
    for q in states_near_the_centre(cell, 40):
        found = core.safe_intervals(cell.collision.core, 0, q, [], LEVELS, others=[moving])
        stays = np.zeros(len(other) + 2, bool)
        for lo, hi in found:
            stays[lo : min(hi, len(stays))] = True
        instants = np.arange(len(stays) * 4 + 1) / 4
        rows = np.array([[np.interp(t, np.arange(len(other)), joint) for joint in other.T] for t in instants])
        gaps = cell.collision.pair_clearance("arm0", np.repeat(q[None], len(rows), 0), "arm1", rows)
        least = np.array([gaps[4 * k : 4 * k + 5].min() for k in range(len(stays))])
        assert (least[stays] >= PROOF_M - FLOAT_M).all()
        assert (least[~stays] <= 0.035).all()
        touched += (~stays).any()
        passed += (~stays).any() and found[-1][1] == core.FOREVER
    assert touched > 5
    assert passed > 2


def test_a_path_is_clear_of_dynamic_obstacles_at_every_instant(cell):
    own, other = sweep(cell, "arm0", -1), sweep(cell, "arm1", 1)
    moving = cell.collision.motion("arm1", other)
    planner = single_arm(cell, own)
    alone, _ = planner.plan([], 1, core.Clock(60.0))
    assert min(gap(cell, alone, other, t) for t in np.arange(0, len(alone), 0.5)) < 0
    for seed in range(3):
        path, _ = planner.plan([], seed, core.Clock(60.0), others=[moving])
        np.testing.assert_allclose(path[[0, -1]], own[[0, -1]], rtol=0, atol=1e-6)
        assert np.abs(np.diff(path, axis=0)).max() <= STEP_RAD * (1 + 1e-3)
        horizon = max(len(path), len(other))
        assert min(gap(cell, path, other, t) for t in np.arange(0, horizon, 0.5)) >= PROOF_M - FLOAT_M


def test_constraints_and_dynamic_obstacles_hold_together(cell):
    own, other = sweep(cell, "arm0", -1), sweep(cell, "arm1", 1)
    moving, ball = cell.collision.motion("arm1", other), core.Constraint.ball(own[-1], 0.3, 0, 70)
    path, _ = single_arm(cell, own).plan([ball], 1, core.Clock(60.0), others=[moving])
    mine = cell.collision.motion("arm0", path)
    assert not core.breaks_constraint(cell.collision.core, mine, [ball], MARGIN_M)
    assert not len(cell.collision.conflict_instants([mine, moving], [(0, 1)], core.Levels(PROOF_M, 0.6 * PROOF_M))[0])
    assert len(path) - 1 >= 70


def test_an_arm_that_stops_at_the_goal_leaves_no_path_and_one_that_passes_does(cell):
    own = sweep(cell, "arm0", -1)
    planner = single_arm(cell, own)
    for rows, found in ((sweep(cell, "arm1", 1), True), (own_goal_blocked(cell, own), False)):
        path, _ = planner.plan(
            [],
            1,
            core.Clock(60.0),
            settings=core.SingleArmSettings(max_iterations=60),
            others=[cell.collision.motion("arm1", rows)],
        )
        assert (path is not None) == found


def own_goal_blocked(cell, own):
    """Returns a path of the other arm that ends on this arm's goal."""
    rng = np.random.default_rng(3)
    home = np.array(cell.arms[1].robot.home)
    ends = home + rng.uniform(-1.5, 1.5, (4000, 6))
    near = cell.collision.pair_clearance("arm0", np.repeat(own[-1:], len(ends), 0), "arm1", ends)
    end = ends[np.flatnonzero((near < -0.02) & cell.collision.is_free("arm1", ends))[0]]
    steps = int(np.ceil(np.abs(end - home).max() / STEP_RAD))
    return home + np.linspace(0, 1, steps + 1)[:, None] * (end - home)


def test_a_dynamic_obstacle_that_starts_long_after_the_arrival_still_counts(cell):
    """The obstacle passes through the goal after the arrival, so the arm moves aside and returns."""
    own = sweep(cell, "arm0", -1, far=0.4)
    late = sweep(cell, "arm1", 1, wait=60)
    assert min(gap(cell, own, late, t) for t in range(60, len(late))) < 0
    path, _ = single_arm(cell, own).plan([], 1, core.Clock(60.0), others=[cell.collision.motion("arm1", late)])
    assert len(path) > 60
    assert min(gap(cell, path, late, t) for t in np.arange(60, len(late) + 1, 0.25)) >= PROOF_M - FLOAT_M


def test_the_same_seed_finds_the_same_path_after_other_calls(cell):
    own, moving = sweep(cell, "arm0", -1), cell.collision.motion("arm1", sweep(cell, "arm1", 1))
    ball = core.Constraint.ball((own[0] + own[-1]) / 2, 0.3, 0, core.FOREVER)
    planner = single_arm(cell, own)
    paths = [planner.plan([ball], seed, core.Clock(60.0), others=[moving])[0] for seed in (1, 2, 1)]
    np.testing.assert_array_equal(paths[0], paths[2])
    assert paths[0].shape != paths[1].shape or not np.array_equal(paths[0], paths[1])


def detour(planner, own):
    """Returns a path around a ball that blocks the straight line for ever, without shortcuts."""
    ball = core.Constraint.ball((own[0] + own[-1]) / 2, 0.2, 0, core.FOREVER)
    return planner.plan([ball], 1, core.Clock(60.0), settings=core.SingleArmSettings(shortcuts=0))[0]


def test_an_experience_that_holds_is_the_solution(cell):
    own = sweep(cell, "arm0", -1)
    planner = single_arm(cell, own)
    before = detour(planner, own)
    path, iterations = planner.plan(
        [], 1, core.Clock(60.0), settings=core.SingleArmSettings(shortcuts=0), experience=before
    )
    assert iterations == 0
    np.testing.assert_allclose(path, before, rtol=0, atol=1e-3)
    straight, _ = planner.plan([], 1, core.Clock(60.0), settings=core.SingleArmSettings(shortcuts=0))
    assert np.abs(np.diff(straight, axis=0)).sum() < np.abs(np.diff(path, axis=0)).sum() - 0.1


def test_the_valid_beginning_of_an_experience_is_kept(cell):
    own = sweep(cell, "arm0", -1)
    planner = single_arm(cell, own)
    before = detour(planner, own)
    k = int(0.7 * len(before))
    closed = core.Constraint.ball(before[k], 0.15, 0, core.FOREVER)
    path, _ = planner.plan(
        [closed], 1, core.Clock(60.0), settings=core.SingleArmSettings(shortcuts=0), experience=before
    )
    assert not core.breaks_constraint(cell.collision.core, cell.collision.motion("arm0", path), [closed], MARGIN_M)
    shared = np.abs(path[: k // 2] - before[: k // 2]).max(axis=1)
    fresh, _ = planner.plan([closed], 1, core.Clock(60.0), settings=core.SingleArmSettings(shortcuts=0))
    assert (shared < 1e-3).all()
    assert np.abs(fresh[: k // 2] - before[: k // 2]).max() > 0.01


@pytest.mark.parametrize("rows", [0, 1])
def test_an_experience_of_nothing_changes_nothing(cell, rows):
    own = sweep(cell, "arm0", -1)
    planner = single_arm(cell, own)
    path, _ = planner.plan([], 1, core.Clock(60.0), experience=own[:rows])
    np.testing.assert_array_equal(path, planner.plan([], 1, core.Clock(60.0))[0])


def test_a_motion_of_no_other_arm_of_the_cell_is_refused(cell):
    own, reference = sweep(cell, "arm0", -1), ring_cell(2)
    planner, clock = single_arm(cell, own), core.Clock(1.0)
    mine, theirs = cell.collision.motion("arm0", own), reference.collision.motion("arm1", own)
    with pytest.raises(ValueError, match="another cell"):
        planner.plan([], 0, clock, others=[theirs])
    with pytest.raises(ValueError, match="the arm itself"):
        planner.plan([], 0, clock, others=[mine])
    with pytest.raises(ValueError, match="another cell"):
        core.conflict_instants(cell.collision.core, [mine, theirs], np.array([[0, 1]], np.int32), LEVELS)
    for wrong in (None, 3, core.Constraint.ball(own[0], 0.1, 0, 1)):
        with pytest.raises(TypeError, match="Motion"):
            planner.plan([], 0, clock, others=[wrong])
    with pytest.raises(ValueError, match="joints"):
        planner.plan([], 0, clock, experience=np.zeros((3, 5)))
    with pytest.raises(ValueError, match="finite"):
        planner.plan([], 0, clock, experience=np.full((3, 6), np.nan))


def test_a_constraint_of_another_arm_is_refused(cell):
    own = sweep(cell, "arm0", -1)
    planner, motion, compiled = single_arm(cell, own), cell.collision.motion("arm0", own), cell.collision.core
    for wrong, error in (
        (None, TypeError),
        (motion, TypeError),
        (core.Constraint.ball(np.zeros(5), 1, 0, 1), ValueError),
    ):
        with pytest.raises(error, match="onstraint"):
            planner.plan([wrong], 0, core.Clock(1.0))
        with pytest.raises(error, match="onstraint"):
            core.safe_intervals(compiled, 0, own[0], [wrong], LEVELS)
        with pytest.raises(error, match="onstraint"):
            core.breaks_constraint(compiled, motion, [wrong], MARGIN_M)


def test_a_constraint_outlives_the_motion_that_it_was_made_of():
    cell = ring_cell(2)
    other, q = sweep(cell, "arm1", 1), states_near_the_centre(cell, 20)
    motion = cell.collision.motion("arm1", other)
    parts = core.Constraint.moving(motion, 0, core.FOREVER)
    ask = (cell.collision.core, 0, q[0])
    expected = core.safe_intervals(*ask, parts, LEVELS)
    del motion
    gc.collect()
    np.testing.assert_array_equal(core.safe_intervals(*ask, parts, LEVELS), expected)
