"""Execution of plans through the actuators: reached or not, contacts, tracking, and plans that do not fit."""

import dataclasses
import warnings

import gymnasium
import numpy as np
import pytest
from support.straight_plans import FACING, LEVEL, STEEP, elsewhere, everyone, straight

from mmp_env.errors import MmpError, UnretimedPlanWarning
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot import frozen_array
from mmp_env.mujoco_import import mujoco
from mmp_env.retime import retime
from mmp_env.robot_folders import robot_names
from mmp_env.sim.execution import REACHED_RAD

pytestmark = pytest.mark.filterwarnings("ignore::mmp_env.errors.UnretimedPlanWarning")


def environment(cell):
    return MultiArmCellEnv(cell=cell)


@pytest.mark.parametrize("robot", robot_names())
def test_arms_follow_a_plan_closely_touch_nothing_and_stop_at_its_end(robot):
    env = gymnasium.make("MultiArmCell-4", robot=robot).unwrapped
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    env.reset(options={"start": start, "goal": goal})
    plan = straight(env.cell, start, goal)
    report = env.execute(plan)
    assert report.reached
    assert report.contacts == []
    assert report.max_tracking_error_rad < 0.01
    assert not report.moved_to_start
    assert plan.makespan_s <= report.duration_s <= plan.makespan_s + 0.6
    assert report.times[[0, -1]].tolist() == [0, report.duration_s]
    for name, q in report.positions.items():
        assert q.shape == (len(report.times), env.cell.arm(name).dof)
        np.testing.assert_array_equal(q[0], start[name])
        np.testing.assert_allclose(q[-1], goal[name], atol=REACHED_RAD)
    np.testing.assert_array_equal(env.data.qpos, np.concatenate([q[-1] for q in report.positions.values()]))
    np.testing.assert_allclose(env.data.qvel, 0, atol=2e-3)


def test_the_next_step_continues_from_the_end_of_the_plan():
    env = MultiArmCellEnv(cell=ring_cell(2), control_mode="velocity")
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    env.execute(straight(env.cell, start, goal))
    observation, reward, terminated, _, info = env.step(np.zeros(12, np.float32))
    assert info["is_success"]
    assert terminated
    assert abs(reward) < 10.1
    np.testing.assert_allclose(observation["joint_positions"], np.concatenate(list(goal.values())), atol=0.01)
    np.testing.assert_array_equal(observation["goal_positions"], np.concatenate(list(goal.values())))


def test_recorded_positions_lie_on_the_plan():
    env = environment(ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    corner = {name: goal[name] + 0.3 for name in goal}
    plan = straight(env.cell, start, goal, via=[corner])
    report = env.execute(plan)
    for k in range(0, len(report.times), 50):
        planned = plan.at(report.times[k])
        for name, q in planned.items():
            assert np.abs(report.positions[name][k] - q).max() <= report.max_tracking_error_rad


def test_two_arms_driven_into_each_other_are_reported_with_time_bodies_and_depth():
    env = environment(ring_cell(2))
    names = env.cell.arm_names
    start, goal = dict.fromkeys(names, STEEP + FACING), dict.fromkeys(names, LEVEL + FACING)
    report = env.execute(straight(env.cell, start, goal))
    first = report.contacts[0]
    assert {first.body_a.partition("/")[0], first.body_b.partition("/")[0]} == set(names)
    assert 0 < first.time_s < report.duration_s
    assert first.depth_m > 0
    assert report.contacts == sorted(report.contacts, key=lambda contact: contact.time_s)
    assert not report.reached
    assert report.max_tracking_error_rad > REACHED_RAD


def with_ball(cell, position, radius):
    pose = {"position": frozen_array(position), "quaternion": frozen_array([1, 0, 0, 0])}
    return dataclasses.replace(
        cell, obstacles=(*cell.obstacles, Obstacle(name="ball", shape="sphere", radius=radius, **pose))
    )


def gaps_to_ball(env, rows):
    """Returns the distance [m] of `arm0` from the ball at each row of joints of all arms."""
    model, data = env.model, env.data
    ball = model.geom("obstacle/ball").id
    geoms = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name.startswith("arm0/wrist")]
    out = []
    for row in rows:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        out.append(min(mujoco.mj_geomDistance(model, data, geom, ball, 1.0, None) for geom in geoms))
    return np.array(out)


def test_a_contact_is_reported_however_short():
    plain, radius, depth = ring_cell(2), 0.02, 4e-4
    start = everyone(plain, "tucked") | {"arm0": STEEP}
    goal = start | {"arm0": LEVEL}
    tip = plain.collision.tool_points("arm0", (STEEP + LEVEL)[None] / 2)[0]
    outside = tip + 0.1 * (tip - plain.arms[0].position) / np.linalg.norm(tip - plain.arms[0].position)
    env = environment(with_ball(plain, outside, radius))
    passing = env.execute(straight(env.cell, start, goal))
    assert passing.contacts == []
    gaps = gaps_to_ball(env, np.hstack([passing.positions[name] for name in plain.arm_names]))
    grazing = environment(with_ball(plain, outside, radius + gaps.min() + depth))
    assert (gaps < gaps.min() + depth).sum() * grazing.model.opt.timestep < 0.03
    contacts = grazing.execute(straight(grazing.cell, start, goal)).contacts
    assert {(contact.body_a, contact.body_b) for contact in contacts} == {("arm0/wrist3", "obstacle/ball")}
    assert all(0 < contact.depth_m < depth for contact in contacts)
    assert contacts[0].time_s == pytest.approx(passing.times[gaps.argmin()], abs=0.03)


def test_an_arm_driven_into_an_obstacle_names_the_obstacle():
    env = environment(ring_cell(2))
    start = everyone(env.cell, "tucked") | {"arm1": LEVEL}
    goal = start | {"arm1": np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0])}
    report = env.execute(straight(env.cell, start, goal))
    assert {contact.body_b for contact in report.contacts} == {"obstacle/table"}
    assert all(contact.body_a.startswith("arm1/") for contact in report.contacts)


@pytest.mark.parametrize("counted", [True, False])
def test_a_self_contact_is_reported_unless_switched_off(counted):
    env = MultiArmCellEnv(cell=ring_cell(2), self_contacts=counted)
    start = everyone(env.cell, "tucked")
    folded = start | {"arm0": np.array([0.0, -1.57, 3.1, 0.0, 0.0, 0.0])}
    contacts = env.execute(straight(env.cell, start, folded)).contacts
    bodies = {(contact.body_a, contact.body_b) for contact in contacts}
    assert bodies == ({("arm0/upperarm", "arm0/wrist2"), ("arm0/upperarm", "arm0/wrist3")} if counted else set())


def test_arms_that_a_plan_does_not_move_stay_and_a_plan_may_be_for_fewer_arms():
    env = environment(ring_cell(4))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    env.reset(options={"start": start, "goal": goal})
    report = env.execute(straight(env.cell, start, start | {"arm2": goal["arm2"]}, moved=["arm2"]))
    assert report.reached
    np.testing.assert_allclose(report.positions["arm0"][-1], start["arm0"], atol=1e-3)
    pair = dataclasses.replace(env.cell, arms=env.cell.arms[1:3], name="pair")
    here = {name: q[-1] for name, q in report.positions.items()}
    both = {name: here[name] for name in pair.arm_names}
    report = env.execute(straight(pair, both, {name: goal[name] for name in both}))
    assert report.reached
    assert not report.moved_to_start
    assert set(env.problem.goal) == set(env.cell.arm_names)
    np.testing.assert_allclose(env.problem.goal["arm0"], here["arm0"], atol=1e-3)


def test_arms_that_stand_elsewhere_are_put_to_the_start_and_the_report_says_so():
    env = environment(ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    env.reset(options={"start": goal, "goal": goal})
    report = env.execute(straight(env.cell, start, goal))
    assert report.moved_to_start
    assert report.reached
    np.testing.assert_array_equal(report.positions["arm0"][0], start["arm0"])


def test_a_plan_that_stops_short_of_its_goal_has_not_reached_it():
    env = environment(ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    plan = straight(env.cell, start, goal)
    short = dataclasses.replace(
        plan, positions={name: np.array([q[0], q[-1] - 0.03 * np.eye(6)[2]]) for name, q in plan.positions.items()}
    )
    assert not env.execute(short).reached


def test_velocities_of_a_retimed_plan_are_followed_closer_than_its_corners_alone():
    env = environment(ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    times = np.linspace(0, 3, 31)
    phase, rate = (1 - np.cos(np.pi * times / 3)) / 2, np.pi / 6 * np.sin(np.pi * times / 3)
    plan = straight(env.cell, start, goal)
    smooth = dataclasses.replace(
        plan,
        times=times,
        positions={name: start[name] + np.outer(phase, goal[name] - start[name]) for name in start},
        velocities={name: np.outer(rate, goal[name] - start[name]) for name in start},
    )
    errors = [env.execute(each).max_tracking_error_rad for each in (smooth, plan)]
    assert errors[0] < 0.5 * errors[1]


def test_a_plan_that_is_not_retimed_is_executed_with_one_warning_that_names_retime():
    env = environment(ring_cell(2))
    plan = straight(env.cell, everyone(env.cell, "tucked"), elsewhere(env.cell))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(2):
            assert env.execute(plan).reached
    (warning,) = caught
    assert warning.category is UnretimedPlanWarning
    assert "mmp_env.retime.retime(plan)" in str(warning.message)
    assert "retime(plan)" in str(warning.message)


def test_a_retimed_plan_and_one_that_stands_still_cause_no_warning():
    env = environment(ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env.execute(retime(straight(env.cell, start, goal)))
        env.execute(straight(env.cell, goal, goal))


def other_cells():
    """Returns cells that are almost `ring-2`, each with the difference that the message names."""
    cell = ring_cell(2)
    box = cell.obstacles[0]
    turned = place_arm("arm0", "ur5e", cell.arms[0].position, [1.0, 0.0, 0.0, 0.0])
    yield dataclasses.replace(cell, arms=(turned, cell.arms[1])), "the orientation of arm 'arm0' is"
    yield ring_cell(2, "fr5"), "the robot of arm 'arm0' is fr5 there and ur5e here"
    yield ring_cell(4), "position of arm 'arm0' is|an arm 'arm2'"
    moved = dataclasses.replace(cell.arms[0], position=cell.arms[0].position + 0.01)
    yield dataclasses.replace(cell, arms=(moved, cell.arms[1])), "the position of arm 'arm0' is"
    yield dataclasses.replace(cell, arms=(dataclasses.replace(cell.arms[0], name="left"), cell.arms[1])), "'left'"
    yield dataclasses.replace(cell, obstacles=()), "its obstacles are none, those here are table"
    yield dataclasses.replace(cell, obstacles=(dataclasses.replace(box, size=box.size * 2),)), "the size of obstacle"


@pytest.mark.parametrize(("cell", "difference"), list(other_cells()))
def test_a_plan_for_another_cell_is_refused_with_what_differs(cell, difference):
    env = environment(ring_cell(2))
    tucked = everyone(cell, "tucked")
    with pytest.raises(MmpError, match=f"another cell: .*({difference})"):
        env.execute(straight(cell, tucked, tucked))


def test_a_cell_without_the_tool_is_another_cell():
    env = environment(ring_cell(2, "panda"))
    bare = dataclasses.replace(env.cell.arms[0], tool=None)
    cell = dataclasses.replace(env.cell, arms=(bare, env.cell.arms[1]))
    tucked = everyone(cell, "tucked")
    with pytest.raises(MmpError, match="the tool of arm 'arm0' is none there and franka-hand here"):
        env.execute(straight(cell, tucked, tucked))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"times": np.array([0.0, 0.0])}, "do not ascend after 0 s"),
        ({"times": np.array([0.1, 1.0])}, "begins with 0"),
        ({"times": np.array([0.0, np.nan])}, "finite numbers"),
        ({"positions": {}}, "moves no arm"),
        ({"positions": {"arm7": np.zeros((2, 6))}}, "an arm 'arm7', which is not in its cell"),
        ({"positions": {"arm0": np.zeros((3, 6))}}, r"have shape \[3, 6\]; expected \[2, 6\]"),
        ({"positions": {"arm0": np.full((2, 6), np.inf)}}, "not finite"),
        ({"positions": {"arm0": np.full((2, 6), 1e300)}}, "positions of arm 'arm0' reach beyond 10000"),
        ({"velocities": {"arm0": np.zeros((2, 6))}}, "velocities of other arms"),
    ],
)
def test_a_malformed_plan_is_refused(change, fault):
    env = environment(ring_cell(2))
    tucked = everyone(env.cell, "tucked")
    plan = straight(env.cell, tucked, tucked)
    for field, value in change.items():
        object.__setattr__(plan, field, value)  # bypasses the checks of a frozen dataclass
    with pytest.raises(MmpError, match=f"malformed: .*{fault}"):
        env.execute(plan)
