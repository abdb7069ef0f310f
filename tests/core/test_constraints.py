"""Constraints, safe intervals and the single-arm planner against the reference implementation. Times are in steps."""

import numpy as np
import pytest
from reference import clearance, intervals, kinematics, motion, toys

from mmp_env import core
from mmp_env.model.rings import ring_cell
from mmp_env.robot_folders import robot_names
from mmp_tasks.reach import Reach

MARGIN_M, PROOF_M = 0.002, 0.0015
LEVELS = core.Levels(MARGIN_M, PROOF_M)
FLOAT_M, FLOAT_RAD = 1e-5, 1e-6
STEP_RAD = 0.08


def near_states(rng, cell, count):
    """Returns configurations of the first two arms, `count` of each, with a clearance of -5 to 5 cm."""
    q = [toys.random_configurations(rng, arm, 2000) for arm in cell.arms[:2]]
    near = np.flatnonzero(np.abs(cell.collision.pair_clearance("arm0", q[0], "arm1", q[1])) < 0.05)[:count]
    return q[0][near], q[1][near]


def random_constraints(rng, cell, q, q_other):
    """Returns one constraint of each kind about q of arm0, for the core and for the reference implementation."""
    begins = rng.integers(-4, 20, 3)
    windows = [(int(lo), int(max(lo, 0) + length)) for lo, length in zip(begins, rng.integers(1, 9, 3), strict=True)]
    if rng.random() < 0.2:
        windows[0] = (windows[0][0], core.FOREVER)
    (start, end), ball, sphere = windows
    center, radius = q + rng.uniform(-0.1, 0.1, len(q)), rng.uniform(0.02, 0.12)
    frames = kinematics.link_frames(cell.arms[0], q)
    point, ball_radius = frames[rng.integers(2, len(frames)), :3, 3] + rng.uniform(-0.1, 0.1, 3), rng.uniform(0.02, 0.1)
    first, shrink = int(rng.integers(1, 5)), rng.choice([0.0, 0.01])
    native = [
        core.Constraint.standing(cell.collision.core, 1, q_other, shrink=shrink, start=start, end=end),
        core.Constraint.ball(center, radius, *ball),
        core.Constraint.sphere(point, ball_radius, first, *sphere),
    ]
    reference = [
        intervals.standing(cell, "arm1", q_other, start, end, MARGIN_M - shrink),
        intervals.BallConstraint(center, radius, *ball),
        intervals.CloudConstraint(point[None], np.array([ball_radius]), MARGIN_M, first, *sphere),
    ]
    return native, reference


def is_close_call(cell, q, constraint):
    """Returns whether rounding to single precision may decide if q breaks the constraint."""
    if isinstance(constraint, intervals.BallConstraint):
        return abs(np.abs(q - constraint.center).max() - constraint.radius) < FLOAT_RAD
    own = clearance.cloud(cell, cell.arms[0], q)
    own = own.only(own.parts >= constraint.first_part)
    there = clearance.Cloud(np.zeros(len(constraint.radii), int), constraint.centers, constraint.radii)
    return abs(clearance.least_gap(own, there) - constraint.margin) < FLOAT_M


@pytest.mark.parametrize("robots", [("ur5e", "panda"), ("panda", "panda"), ("fr5", "piper"), ("piper", "ur5e")])
def test_safe_intervals_are_what_broken_constraints_leave(robots):
    rng = np.random.default_rng(51)
    cell = toys.random_cell(rng, robots, "28", obstacles=False)
    broken = 0
    for q, q_other in zip(*near_states(rng, cell, 40), strict=True):
        native, reference = random_constraints(rng, cell, q, q_other)
        assert not any(is_close_call(cell, q, constraint) for constraint in reference)
        found = core.safe_intervals(cell.collision.core, 0, q, native, LEVELS)
        expected = intervals.safe_intervals(cell, "arm0", q, reference)
        # Windows are open, so two adjacent windows leave a single instant between them. It is not a usable interval.
        found = [(lo, np.inf if hi == core.FOREVER else hi) for lo, hi in found if lo < hi]
        assert found == [(lo, hi) for lo, hi in expected if lo < core.FOREVER]
        broken += sum(constraint.is_broken(cell, "arm0", q) for constraint in reference)
    assert 20 < broken < 100


def test_the_window_and_its_ends_are_kept():
    constraint = core.Constraint.ball(np.zeros(2), 0.1, -3, 7)
    assert (constraint.start, constraint.end) == (-3, 7)


@pytest.mark.parametrize("robots", [("ur5e", "panda"), ("panda", "piper"), ("fr5", "fr5")])
def test_a_path_breaks_a_constraint_where_a_quarter_of_a_step_does(robots):
    rng = np.random.default_rng(52)
    cell = toys.random_cell(rng, robots, "28", obstacles=False)
    verdicts = []
    for q, q_other in zip(*near_states(rng, cell, 25), strict=True):
        moves = rng.uniform(-0.1, 0.1, (rng.integers(1, 12), len(q)))
        path = np.vstack([q, q + np.cumsum(moves, axis=0)])
        moving = cell.collision.motion("arm0", path)
        for native, reference in zip(*random_constraints(rng, cell, q, q_other), strict=True):
            looked_at = [motion.along(path[k], path[k + 1], 4) for k in range(len(path) - 1)]
            if any(is_close_call(cell, at, reference) for ends in looked_at for at in ends):
                continue
            expected = intervals.is_path_breaking(cell, "arm0", path, reference, per_step=4)
            assert core.breaks_constraint(cell.collision.core, moving, [native], MARGIN_M) == expected
            verdicts.append(expected)
    assert min(sum(verdicts), len(verdicts) - sum(verdicts)) >= 10


def test_a_window_that_ends_before_the_start_is_never_broken():
    cell, q = narrow_arm(), np.zeros(2)
    path = cell.collision.motion("a", np.zeros((3, 2)))
    for window, broken in [((-3, -1), False), ((-3, 0), False), ((-3, 1), True)]:
        constraint = core.Constraint.ball(q, 0.1, *window)
        assert core.breaks_constraint(cell.collision.core, path, [constraint], MARGIN_M) == broken


def single_arm(cell, name, start, goal, seed=0):
    k = cell.arm_index(name)
    step = np.full(cell.arms[k].dof, STEP_RAD)
    return core.SingleArm(
        cell.collision.core, k, start=start, goals=goal[None], max_step=step, levels=LEVELS, seed=seed
    )


def assert_path_is_right(cell, name, path, start, goal, constraints):
    """Checks ends, speed, limits, contacts and constraints of a path by the reference implementation."""
    np.testing.assert_allclose(path[[0, -1]], [start, goal], rtol=0, atol=FLOAT_RAD)
    assert np.abs(np.diff(path, axis=0)).max() <= STEP_RAD * (1 + 1e-3)
    robot = cell.arm(name).robot
    assert (path >= robot.lower - FLOAT_RAD).all()
    assert (path <= robot.upper + FLOAT_RAD).all()
    proved = PROOF_M - FLOAT_M
    halves = np.vstack([path[::2], (path[1:] + path[:-1]) / 2])
    assert min(clearance.static_clearance(cell, name, q) for q in halves) >= proved
    for constraint in constraints:
        assert not intervals.is_path_breaking(cell, name, path, constraint, per_step=4)


@pytest.mark.parametrize(("robot", "spheres"), [*((name, "28") for name in robot_names()), ("ur5e", "fine")])
def test_planned_paths_keep_ends_speed_limits_clearance_and_constraints(robot, spheres):
    cell = ring_cell(2, robot, spheres)
    start, goal = Reach().sample(cell, np.random.default_rng(53))
    planner = single_arm(cell, "arm0", start["arm0"], goal["arm0"])
    proved = PROOF_M - FLOAT_M
    places = [("standing", start["arm1"], (0, 25)), ("standing", goal["arm1"], (10, core.FOREVER))]
    native = [
        core.Constraint.standing(cell.collision.core, 1, q, start=begin, end=end) for _, q, (begin, end) in places
    ]
    reference = [intervals.standing(cell, "arm1", q, *window, proved) for _, q, window in places]
    # The constraint then blocks the middle of the unconstrained path for some time.
    free, _ = planner.plan([], 0, core.Clock(60.0))
    assert_path_is_right(cell, "arm0", free, start["arm0"], goal["arm0"], [])
    halfway = free[len(free) // 2].copy()
    native.append(core.Constraint.ball(halfway, 0.2, 0, len(free)))
    reference.append(intervals.BallConstraint(halfway, 0.2 - FLOAT_RAD, 0, len(free)))
    path, _ = planner.plan(native, 0, core.Clock(60.0))
    assert_path_is_right(cell, "arm0", path, start["arm0"], goal["arm0"], reference)
    assert len(path) != len(free) or not np.array_equal(path, free)


def narrow_arm():
    """Returns a toy arm whose second joint can hardly move, so there is a single path."""
    limits = {"lower": np.array([-np.pi, -1e-3]), "upper": np.array([np.pi, 1e-3])}
    return toys.toy_cell(toys.toy_arm("a", [0, 0, 0], **limits))


def test_a_free_straight_path_is_driven_at_full_speed():
    path, _ = single_arm(narrow_arm(), "a", np.array([-0.3, 0]), np.array([0.3, 0]), 1).plan([], 0, core.Clock(60.0))
    assert len(path) - 1 == np.ceil(0.6 / STEP_RAD)


def test_an_arm_with_a_single_path_waits_as_long_as_it_must():
    cell, (start, goal) = narrow_arm(), np.array([[-0.3, 0], [0.3, 0]])
    window = (0, 30)
    path, _ = single_arm(cell, "a", start, goal).plan(
        [core.Constraint.ball(np.zeros(2), 0.1, *window)], 0, core.Clock(60.0)
    )
    reference = intervals.BallConstraint(np.zeros(2), 0.1 - FLOAT_RAD, *window)
    assert_path_is_right(cell, "a", path, start, goal, [reference])
    duration = 0.6 / STEP_RAD
    earliest = intervals.earliest_departure(cell, "a", start, goal, duration, [reference], (0, np.inf))
    # Each piece of the path takes whole steps, and the blocked piece is known to 0.03 rad.
    assert earliest + duration <= len(path) - 1 <= earliest + duration + 3


def test_a_goal_that_is_never_free_again_is_not_reached():
    cell, (start, goal) = narrow_arm(), np.array([[-0.3, 0], [0.3, 0]])
    for end, reached in ((core.FOREVER, False), (50, True)):
        forbidden = core.Constraint.ball(goal, 0.1, 5, end)
        path, _ = single_arm(cell, "a", start, goal).plan(
            [forbidden], 0, core.Clock(60.0), settings=core.SingleArmSettings(max_iterations=100)
        )
        assert (path is not None) == reached


def test_the_same_seed_gives_the_same_path_and_another_one_does_not():
    cell = ring_cell(2, "panda")
    start, goal = Reach().sample(cell, np.random.default_rng(54))
    closed = core.Constraint.ball((start["arm0"] + goal["arm0"]) / 2, 0.3, 0, 60)
    paths = [
        single_arm(cell, "arm0", start["arm0"], goal["arm0"], seed).plan([closed], seed, core.Clock(60.0))[0]
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(paths[0], paths[1])
    assert paths[0].shape != paths[2].shape or not np.array_equal(paths[0], paths[2])


def test_a_cancelled_clock_ends_the_search():
    cell, clock = narrow_arm(), core.Clock(60.0)
    assert not clock.expired
    assert 50 < clock.remaining <= 60
    clock.cancel()
    assert clock.expired
    closed = core.Constraint.ball(np.zeros(2), 0.1, 0, core.FOREVER)
    path, iterations = single_arm(cell, "a", np.array([-0.3, 0]), np.array([0.3, 0])).plan(
        [closed], 0, clock, settings=core.SingleArmSettings(max_iterations=100_000)
    )
    assert path is None
    assert iterations < 100
