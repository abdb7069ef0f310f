"""Goals in every form: what they become, what is refused, and what the files keep."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mmp_env import AnyOf, JointGoal, NamedGoal, PoseGoal, Stay, make_problem
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.gym.instances import draw_instance
from mmp_env.ik import branches
from mmp_env.model.goals import as_goal, flat, goal_to_data
from mmp_env.model.margins import NO_MARGINS, Margins
from mmp_env.model.rings import ring_cell
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.problems.candidates import MOST_CANDIDATES, are_free_alone, candidates
from mmp_env.problems.resolution import Resolved, keeping
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.reach import Reach

CELL = ring_cell(2)
START, GOAL = Reach().sample(CELL, np.random.default_rng(3))


def tool_pose(arm, q):
    return arm.T_world_base @ kinematics(arm.robot, arm.tool).tool_pose(q)


def pose_goal(arm, q, free=None):
    """Returns the pose of the tool at q as a goal. The quaternion comes from the matrix by its largest column."""
    pose = tool_pose(arm, q)
    r = pose[:3, :3]
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
        ]
    )
    x, y, z, w = np.linalg.eigh(k / 3)[1][:, -1]
    return PoseGoal(pose[:3, 3], [w, x, y, z], free)


POSES = {arm.name: pose_goal(arm, GOAL[arm.name]) for arm in CELL.arms}


def test_candidates_bring_the_tool_to_its_pose_and_the_nearest_comes_first():
    problem = make_problem(CELL, START, POSES)
    for arm in CELL.arms:
        rows = problem.goals[arm.name]
        assert len(rows) > 8  # branches, and turns of the joints
        wanted = tool_pose(arm, GOAL[arm.name])
        for q in rows:
            np.testing.assert_allclose(tool_pose(arm, q), wanted, atol=2e-6)
            assert CELL.collision.is_free(arm.name, q[None])[0]
        distance = np.abs(rows - START[arm.name]).sum(axis=1)
        assert (np.diff(distance) >= -1e-12).all()
        assert distance[0] <= np.abs(GOAL[arm.name] - START[arm.name]).sum() + 1e-6
        assert (rows == problem.goal[arm.name]).all(axis=1).any()


def test_the_chosen_candidates_are_free_together():
    problem = make_problem(CELL, START, POSES)
    assert CELL.collision.clearance({name: q[None] for name, q in problem.goal.items()})[0] >= problem.margin


def test_eight_arms_with_poses_find_a_combination_among_few():
    cell = ring_cell(8)
    start, goal = draw_instance(cell, seed=11)
    problem = make_problem(cell, start, {arm.name: pose_goal(arm, goal[arm.name]) for arm in cell.arms})
    assert cell.collision.clearance({name: q[None] for name, q in problem.goal.items()})[0] >= problem.margin


def test_the_lower_bound_is_that_of_the_nearest_candidates():
    problem = make_problem(CELL, START, POSES)
    nearest = sum(np.abs(problem.goals[name][0] - START[name]).sum() for name in CELL.arm_names)
    assert problem.cost_lower_bound_rad == pytest.approx(nearest)
    assert problem.choosing({name: rows[-1] for name, rows in problem.goals.items()}).cost_lower_bound_rad == nearest


def test_choosing_changes_the_goal_alone():
    problem = make_problem(CELL, START, POSES)
    assert problem.choosing(problem.goal) is problem
    last = {name: rows[-1] for name, rows in problem.goals.items()}
    other = problem.choosing(last)
    assert all((other.goal[name] == last[name]).all() for name in last)
    assert other.goals is problem.goals
    assert other.goal_asked is problem.goal_asked


def test_configurations_alone_give_one_candidate_and_nothing_asked():
    problem = make_problem(CELL, START, GOAL)
    assert {name: rows.shape for name, rows in problem.goals.items()} == dict.fromkeys(CELL.arm_names, (1, 6))
    assert problem.goal_asked == {}


def test_names_and_stay_and_any():
    goals = {"arm0": "stay", "arm1": {"any": ["tucked", POSES["arm1"], list(GOAL["arm1"])]}}
    problem = make_problem(CELL, START, goals)
    np.testing.assert_array_equal(problem.goals["arm0"], START["arm0"][None])
    assert len(problem.goals["arm1"]) > 3
    assert problem.goal_asked["arm0"] == Stay()
    home = make_problem(CELL, {"arm0": "home", "arm1": "tucked"}, {"arm0": "tucked", "arm1": "stay"})
    np.testing.assert_array_equal(home.start["arm0"], CELL.arms[0].robot.home)
    np.testing.assert_array_equal(home.goal["arm0"], CELL.arms[0].robot.tucked)


@pytest.mark.parametrize("free", ["z", "rotation"])
def test_a_free_rotation_gives_other_rotations_at_the_same_place(free):
    arm = CELL.arms[0]
    problem = make_problem(CELL, START, {"arm0": pose_goal(arm, GOAL["arm0"], free), "arm1": "stay"})
    poses = [tool_pose(arm, q) for q in problem.goals["arm0"]]
    wanted = tool_pose(arm, GOAL["arm0"])
    axes = np.array([pose[:3, 2] for pose in poses])
    for pose in poses:
        np.testing.assert_allclose(pose[:3, 3], wanted[:3, 3], atol=2e-6)
    assert np.allclose(axes, wanted[:3, 2], atol=2e-6) == (free == "z")
    assert not all(np.allclose(pose[:3, 0], wanted[:3, 0], atol=1e-3) for pose in poses)


def test_a_start_may_be_a_pose():
    problem = make_problem(CELL, POSES, START)
    for arm in CELL.arms:
        np.testing.assert_allclose(tool_pose(arm, problem.start[arm.name]), tool_pose(arm, GOAL[arm.name]), atol=2e-6)
    assert {name: rows.shape for name, rows in problem.goals.items()} == dict.fromkeys(CELL.arm_names, (1, 6))


FORMS = [
    [0.0] * 6,
    "home",
    "stay",
    {"pose": {"position": [0.1, 0.2, 0.3], "quaternion": [1.0, 0.0, 0.0, 0.0]}},
    {"pose": {"position": [0.1, 0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0], "free": "z"}},
    {"pose": {"position": [0.1, 0.2, 0.3], "free": "rotation"}},
    {"any": ["tucked", [0.5] * 6, {"any": ["stay"]}]},
]


@pytest.mark.parametrize("form", FORMS, ids=str)
def test_every_form_is_written_as_it_was_read(form):
    assert goal_to_data(as_goal(form, "goal")) == form
    assert json.loads(json.dumps(goal_to_data(as_goal(form, "goal")))) == form


def test_flat_lists_what_any_holds():
    goal = AnyOf(("home", AnyOf((Stay(), [0.0] * 6))))
    assert [type(each) for each in flat(goal)] == [NamedGoal, Stay, JointGoal]


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("hme", "unknown named configuration 'hme'. Did you mean 'home'"),
        ({"any": []}, "has 0 goals; it needs at least one"),
        ({"pose": {"position": [0, 0, 1]}}, "a pose has no quaternion"),
        ({"pose": {"quaternion": [1, 0, 0, 0]}}, "pose has no position"),
        ({"pose": {"position": [0, 0, 1], "quaternion": [0, 0, 0, 0]}}, "which is no rotation"),
        ({"pose": {"position": [0, 0, np.nan], "quaternion": [1, 0, 0, 0]}}, "it must be finite numbers"),
        ({"pose": {"position": [0, 0], "quaternion": [1, 0, 0, 0]}}, "it must be 3 numbers"),
        ({"pose": {"position": [0, 0, 1], "free": "y"}}, "unknown freedom of a pose"),
        ({"pose": {"position": [0, 0, 1], "quat": [1, 0, 0, 0]}}, "Did you mean 'quaternion'"),
        ({"poses": 1}, 'an object with "pose" or "any"'),
        (True, "it must be a list of joint angles"),
        ([0.0] * 5, "a ur5e has 6 joints"),
        (PoseGoal([5, 0, 1], [1, 0, 0, 0]), "is out of reach: [5.000, 0.000, 1.000] is"),
        (PoseGoal([0.4, 0, -0.3], [1, 0, 0, 0]), "goal of arm 'arm0'"),
    ],
    ids=str,
)
def test_a_bad_goal_is_refused_with_arm_and_reason(goal, words):
    with pytest.raises(MmpError, match="arm0") as refused:
        make_problem(CELL, START, {"arm0": goal, "arm1": "stay"})
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("start", ["stay", {"any": ["home"]}])
def test_a_start_is_one_configuration_or_pose(start):
    with pytest.raises(MmpError, match="start of arm 'arm0' must be one configuration or pose"):
        make_problem(CELL, {"arm0": start, "arm1": "home"}, GOAL)


def test_a_pose_under_the_table_names_what_is_in_the_way():
    below = PoseGoal([0.1, 0.0, -0.25], [0.0, 1.0, 0.0, 0.0])
    with pytest.raises(InvalidInstanceError, match=r"of arm 'arm0': .* in collision.*obstacle/table, \d+\.\d mm deep"):
        make_problem(CELL, START, {"arm0": below, "arm1": "stay"})


def test_two_tools_at_one_place_cannot_both_be_there():
    same = dict.fromkeys(CELL.arm_names, POSES["arm0"])
    with pytest.raises(InvalidInstanceError, match=r"arms 'arm0' and 'arm1' cannot both be at their goals; .*mm deep"):
        make_problem(CELL, START, same)


def test_a_margin_that_was_asked_for_holds_for_every_candidate():
    problem = make_problem(CELL, START, POSES, margin={"self": 0.01})
    assert problem.margins.self == 0.01
    for name, rows in problem.goals.items():
        others = {other: START[other] for other in CELL.arm_names if other != name}
        assert min(CELL.collision.nearest({name: q, **others})["self"].clearance_m for q in rows) >= 0.01


def test_the_same_problem_has_the_same_candidates():
    first, second = (make_problem(CELL, START, POSES) for _ in range(2))
    for name, rows in first.goals.items():
        np.testing.assert_array_equal(rows, second.goals[name])


def test_a_pose_normalises_its_quaternion():
    np.testing.assert_allclose(PoseGoal([0, 0, 1], [2, 0, 0, 0]).quaternion, [1, 0, 0, 0])
    assert matrix_from_quaternion(PoseGoal([0, 0, 1], [0, 3, 0, 0]).quaternion)[1, 1] == -1


def test_goals_in_goals_are_counted_together():
    hundred = AnyOf(["home"] * 100)
    assert AnyOf([hundred] * 10).count == 1000
    with pytest.raises(MmpError, match="any of 1100 goals"):
        AnyOf([hundred] * 11)
    deep = AnyOf(["home"])
    for _ in range(7):
        deep = AnyOf([deep])
    with pytest.raises(MmpError, match="nested 9 times"):
        AnyOf([deep])


def test_the_nearest_candidate_of_every_posture_is_among_the_candidates():
    arm = CELL.arms[0]
    found = candidates(arm, POSES["arm0"], START["arm0"], "goal")
    assert len(found) == MOST_CANDIDATES
    circles = np.round(np.hstack([np.cos(found.q), np.sin(found.q)]), 5)
    same = (np.abs(circles[:, None] - circles).max(axis=2) < 1e-4) == (found.posture[:, None] == found.posture)
    assert same.all()
    in_base = np.linalg.inv(arm.T_world_base) @ tool_pose(arm, GOAL["arm0"])
    nearest = {}
    for q in branches(arm.robot, arm.tool, in_base, near=START["arm0"], limit=10_000):
        nearest.setdefault(tuple(np.round(np.hstack([np.cos(q), np.sin(q)]), 4) + 0.0), q)
    firsts = found.q[found.nearest_of_postures]
    assert len(firsts) == len(nearest)
    for q in nearest.values():
        assert np.abs(firsts - q).max(axis=1).min() < 1e-6


def test_a_pose_that_joint_limits_forbid_names_the_joint():
    arm = CELL.arms[0]
    q = GOAL["arm0"]
    tight = np.array([*arm.robot.upper[:4], 0.0, arm.robot.upper[5]])
    robot = replace(arm.robot, upper=tight, lower=np.array([*arm.robot.lower[:4], -1e-3, arm.robot.lower[5]]))
    with pytest.raises(
        InvalidInstanceError, match=r"outside the joint limits: .* joint 5 .* allowed: -0.0010 to 0.0000"
    ):
        candidates(replace(arm, robot=robot), POSES["arm0"], q, "goal of arm 'arm0'")
    far = PoseGoal([9.0, 0.0, 0.5], [1, 0, 0, 0])
    with pytest.raises(
        InvalidInstanceError, match=r"out of reach: .* no configuration of a ur5e brings the tool there"
    ):
        candidates(arm, far, q, "goal of arm 'arm0'")


@pytest.mark.parametrize("seed", range(4))
def test_every_candidate_keeps_the_margins_of_the_problem(seed):
    cell = ring_cell(4)
    start, goal = draw_instance(cell, seed=seed)
    problem = make_problem(cell, start, {arm.name: pose_goal(arm, goal[arm.name]) for arm in cell.arms})
    for arm in cell.arms:
        assert are_free_alone(cell, arm, problem.goals[arm.name], problem.margins, 0.0).all()


def test_candidates_are_kept_by_the_margins_that_the_problem_gets():
    arm = CELL.arms[0]
    rows = candidates(arm, POSES["arm0"], START["arm0"], "goal").q
    wide = Margins(arms=0.002, obstacles=0.15, self=0.002)
    found = Resolved(chosen={"arm0": rows[3]}, candidates={"arm0": rows}, margins=NO_MARGINS)
    one = replace(CELL, arms=(arm,))
    kept = keeping(one, found, POSES, wide)["arm0"]
    free = are_free_alone(one, arm, rows, wide, 0.0)
    assert 0 < len(kept) < len(rows)
    assert len(kept) == (free | (np.arange(len(rows)) == 3)).sum()


def test_candidates_of_several_goals_are_within_the_limits():
    arm = ring_cell(2).arms[0]
    goal = as_goal({"any": [[1e300] * 6, "tucked", [0.1] * 6]}, "goal")
    found = candidates(arm, goal, arm.robot.home, "goal of arm 'arm0'")
    assert len(found) == 2
    assert np.abs(found.q).max() < 10.0
