"""`OnlinePlanner`: what it commits keeps all limits and margins, whatever moves and whichever goals come."""

from dataclasses import replace

import numpy as np
import pytest
from support.two_arms import facing_cell, reaching

from mmp_env import OnlinePlanner, check_plan, make_problem
from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle
from mmp_env.model.plan import Plan
from mmp_env.retime import retime

ENOUGH_S = 2.0
"""Time for a call, more than any machine needs."""
START = {"left": reaching(1.2), "right": reaching(1.2)}
GOAL = {"left": reaching(0.4), "right": reaching(0.4)}
AWAY = {"left": reaching(1.4), "right": reaching(0.9)}
STEP_S = 0.002


class Clock:
    """A clock that a test sets."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def box(position, edge=0.1, name="box"):
    place, turn = np.array(position, dtype=float), np.array([1.0, 0, 0, 0])
    return Obstacle(name=name, shape="box", position=place, quaternion=turn, size=np.full(3, edge))


def planner(**options):
    clock = Clock()
    return OnlinePlanner(facing_cell(), START, clock=clock, **options), clock


def line_plan(start, goal):
    """Returns a plan along straight lines in joint space."""
    rows = {name: np.stack([start[name], goal[name]]) for name in start}
    return Plan(problem=make_problem(facing_cell(), start, goal), times=np.array([0.0, 1.0]), positions=rows)


def followed(online, begin, end):
    """Returns the configurations of all joints from one time to another, every STEP_S."""
    times = begin + STEP_S * np.arange(round((end - begin) / STEP_S))
    return np.hstack([online.positions(times)[name] for name in ("left", "right")])


def assert_smooth(q, robot):
    """Asserts the limits of velocity, acceleration and jerk of samples, as means over STEP_S."""
    velocity = np.diff(q, axis=0) / STEP_S
    acceleration = np.diff(velocity, axis=0) / STEP_S
    jerk = np.diff(acceleration, axis=0) / STEP_S
    assert np.abs(velocity).max() <= 0.8 + 1e-6
    assert (np.abs(acceleration) <= np.tile(robot.acceleration, 2) + 1e-4).all()
    assert (np.abs(jerk) <= np.tile(robot.jerk, 2) + 1.0).all()


def test_it_reaches_a_goal_and_stays_there():
    online, clock = planner()
    step = online.replan(GOAL, within=ENOUGH_S)
    assert (step.kind, step.arrives, step.reason) == ("continuation", True, "")
    assert step.begins_s >= ENOUGH_S
    q = followed(online, 0.0, step.ends_s + 0.1)
    assert_smooth(q, facing_cell().arms[0].robot)
    np.testing.assert_allclose(q[-1], np.concatenate([*GOAL.values()]), atol=1e-9)
    assert check_plan(online.committed()).valid
    clock.now = step.ends_s + 1.0
    again = online.replan(GOAL, within=ENOUGH_S)
    assert (again.kind, again.arrives, again.ends_s) == ("continuation", True, clock.now)


def test_a_new_goal_brakes_within_the_limits_and_goes_on_from_rest():
    online, clock = planner()
    first = online.replan(GOAL, within=0.5)
    rows = []
    for k in range(60):
        clock.now = 0.1 * k
        # The clock of the test does not follow real time, so calls have all the time they need.
        goal = AWAY if clock.now > first.begins_s + 0.3 else GOAL
        step = online.replan(goal, within=0.5)
        rows.append(followed(online, clock.now, clock.now + 0.1))
        if goal is AWAY and step.arrives and step.ends_s < clock.now:
            break
    q = np.concatenate(rows)
    assert_smooth(q, facing_cell().arms[0].robot)
    np.testing.assert_allclose(q[-1], np.concatenate([*AWAY.values()]), atol=1e-9)


def test_an_obstacle_that_appears_ahead_stops_the_arms_in_time():
    online, clock = planner()
    step = online.replan(GOAL, within=0.5)
    clock.now = step.begins_s + 0.2
    ahead = online.state(step.ends_s - 0.3)
    tool = facing_cell().collision.tool_points("left", ahead["left"][None])[0]
    assert online.add_obstacle(box(tool, edge=0.2), speed=0.0)
    assert online.ends_s < step.ends_s
    rest = online.ends_s
    q = followed(online, clock.now, rest + 0.5)
    assert_smooth(q, facing_cell().arms[0].robot)
    left, right = np.split(q, 2, axis=1)
    with_box = replace(facing_cell(), obstacles=(box(tool, edge=0.2),))
    state = {"left": np.ascontiguousarray(left), "right": np.ascontiguousarray(right)}
    assert with_box.collision.clearance(state).min() >= 0.002
    assert check_plan(online.committed()).valid


def test_the_committed_plan_is_checked_with_the_growth_of_the_obstacle():
    online, clock = planner()
    online.add_obstacle(box([0.0, 0.9, 0.6]), speed=0.3)
    online.replan(GOAL, within=0.5)
    clock.now = 0.2
    online.move_obstacle("box", [0.0, 0.85, 0.6], speed=0.3)
    plan = online.committed()
    assert plan.problem.cell.obstacles[0].speed == 0.3
    assert check_plan(plan).valid
    faster = replace(plan.problem.cell.obstacles[0], speed=3.0)
    assert not check_plan(
        replace(plan, problem=replace(plan.problem, cell=replace(plan.problem.cell, obstacles=(faster,))))
    )


def test_following_a_plan():
    online, _ = planner()
    line = line_plan(START, AWAY)
    step = online.follow(line)
    assert (step.kind, step.arrives) == ("continuation", True)
    with pytest.raises(MmpError, match="does not start where arm 'left' comes to rest"):
        online.follow(line)
    step = online.follow(retime(line_plan(AWAY, START), rate=50.0))
    np.testing.assert_allclose(online.state(step.ends_s + 1.0)["left"], START["left"], atol=1e-9)


def test_goals_that_are_blocked_give_a_stop_and_a_reason():
    online, clock = planner()
    at = facing_cell().collision.tool_points("left", GOAL["left"][None])[0]
    online.add_obstacle(box(at, edge=0.2), speed=0.0)
    step = online.replan(GOAL, within=0.5)
    assert (step.kind, step.arrives) == ("stop", False)
    assert step.reason == "start or goal is too close to a body"
    online.remove_obstacle("box")
    assert online.replan(GOAL, within=0.5).kind == "continuation"
    assert clock.now == 0.0


def test_an_arm_with_a_body_near_it_waits_while_the_others_go_on():
    online, clock = planner()
    above = facing_cell().collision.tool_points("left", START["left"][None])[0] + np.array([0.0, 0.0, 0.25])
    online.add_obstacle(box(above), speed=0.3)

    def call():
        clock.now += 0.2
        online.move_obstacle("box", above, speed=0.3)
        return online.replan(GOAL, within=0.2)

    steps = [call() for _ in range(60)]
    assert "continuation" in {step.kind for step in steps[:30]}
    rest = online.state(clock.now)
    np.testing.assert_array_equal(rest["left"], START["left"])
    np.testing.assert_allclose(rest["right"], GOAL["right"], atol=1e-9)
    assert any("before that can leave (left)" in step.reason for step in steps)
    assert not any(step.arrives for step in steps)
    online.remove_obstacle("box")
    step = online.replan(GOAL, within=ENOUGH_S)
    assert step.arrives
    np.testing.assert_allclose(online.state(step.ends_s)["left"], GOAL["left"], atol=1e-9)


def test_wrong_arguments():
    online, _ = planner()
    online.add_obstacle(box([0.0, 2.0, 0.5]))
    with pytest.raises(MmpError, match="there is an obstacle 'box' already"):
        online.add_obstacle(box([0.0, 2.0, 0.5]))
    with pytest.raises(UnknownNameError, match="box"):
        online.move_obstacle("bx", [0, 0, 0], speed=0.1)
    with pytest.raises(UnknownNameError):
        online.remove_obstacle("cart")
    for pose in ([0, 0], [0, 0, np.nan], [0, 0, 0, 0, 0, 0, 0]):
        with pytest.raises(MmpError, match="pose"):
            online.move_obstacle("box", pose, speed=0.1)
    for speed in (-1.0, np.inf):
        with pytest.raises(MmpError, match="speed"):
            online.move_obstacle("box", [0, 2, 0.5], speed=speed)
    for within in (0.0, -1.0, np.nan, 1e9):
        with pytest.raises(MmpError, match="within"):
            online.replan(GOAL, within=within)
    with pytest.raises(MmpError, match="arm 'right'"):
        online.replan({"left": GOAL["left"]}, within=0.1)
    with pytest.raises(InvalidInstanceError):
        online.replan({**GOAL, "left": np.full(6, 50.0)}, within=0.1)
    with pytest.raises(MmpError, match="planner"):
        OnlinePlanner(facing_cell(), START, planner="auot")
