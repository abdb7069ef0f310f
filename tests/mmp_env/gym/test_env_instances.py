"""The instances of the Gymnasium environment: drawn by seed, given as options, and tasks that break the contract."""

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support.unchecked import unchecked

from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.files.cell_source import find_cell
from mmp_env.gym.cell_instance import InstanceSource
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.gym.instances import draw_instance, draw_problem
from mmp_env.model.goals import PoseGoal, goal_to_data
from mmp_env.model.rings import ring_cell
from mmp_env.retime import retime
from mmp_planners import make as make_planner


def make(name="MultiArmCell-2", **options):
    return gymnasium.make(name, **options)


def tucked(cell):
    return {arm.name: np.array(arm.robot.tucked) for arm in cell.arms}


def test_a_seed_names_the_instance_that_is_drawn_without_an_environment():
    env = make("MultiArmCell-4")
    for seed in (0, 7):
        env.reset(seed=seed)
        start, goal = draw_instance(ring_cell(4), "reach", seed)
        for name in start:
            np.testing.assert_array_equal(env.unwrapped.problem.start[name], start[name])
            np.testing.assert_array_equal(env.unwrapped.problem.goal[name], goal[name])
        assert env.unwrapped.problem.name == f"MultiArmCell-4/{seed}"


def test_later_resets_draw_further_instances_of_the_same_stream():
    drawn = []
    for _ in range(2):
        env = make()
        env.reset(seed=3)
        drawn.append([env.reset()[0]["joint_positions"] for _ in range(2)])
    np.testing.assert_array_equal(*drawn)
    assert not np.array_equal(drawn[0][0], drawn[0][1])


@pytest.mark.parametrize("seed", [-1, True, "a", 1.5])
def test_a_seed_that_is_no_whole_number_is_an_error(seed):
    for draw in (lambda: draw_instance(ring_cell(2), "reach", seed), lambda: make().reset(seed=seed)):
        with unchecked(), pytest.raises(MmpError, match=r"seed is .*; it must be a whole number, 0 or more"):
            draw()


def test_a_margin_is_that_of_every_problem_or_the_instance_is_refused():
    env = make("MultiArmCell-4", margin=0.015)
    env.reset(seed=3)
    assert env.unwrapped.problem.margin == 0.015
    with pytest.raises(InvalidInstanceError, match=r"20\.44 mm apart, and the margin asked for between arms is 50 mm"):
        make("MultiArmCell-4", margin=0.05).reset(seed=3)
    given = {"start": env.unwrapped.problem.start, "goal": env.unwrapped.problem.goal}
    env = make("MultiArmCell-4", margin={"arms": 0.01})
    env.reset(options=given)
    assert (env.unwrapped.problem.margins.arms, env.unwrapped.problem.margins.obstacles) == (0.01, 0.002)


@pytest.mark.parametrize("margin", [-1, "wide", {"legs": 0.1}])
def test_a_bad_margin_is_an_error(margin):
    with unchecked(), pytest.raises(MmpError, match="margin"):
        make(margin=margin)


def test_options_set_the_instance_and_missing_parts_are_drawn():
    env = make()
    cell = env.unwrapped.cell
    goal = draw_instance(cell, "reach", 1)[1]
    observation, info = env.reset(seed=4, options={"start": tucked(cell), "goal": goal})
    np.testing.assert_array_equal(observation["joint_positions"], np.concatenate(list(tucked(cell).values())))
    np.testing.assert_array_equal(observation["goal_positions"], np.concatenate(list(goal.values())))
    farthest = max(np.abs(goal[name] - q).max() for name, q in tucked(cell).items())
    assert info == {"is_success": False, "contacts": [], "distance_rad": pytest.approx(farthest)}
    drawn, _ = draw_instance(cell, "reach", 4)
    observation, _ = env.reset(seed=4, options={"goal": goal})
    np.testing.assert_array_equal(observation["joint_positions"], np.concatenate(list(drawn.values())))


def test_wrong_reset_options_are_named_and_leave_the_environment_as_it_was():
    env = make()
    env.reset(seed=0)
    cell, before = env.unwrapped.cell, env.unwrapped.problem
    through_the_table = tucked(cell) | {"arm0": np.array([0.0, 0.6, 0.0, 0.0, 0.0, 0.0])}
    for options, error, message in [
        ({"begin": {}}, UnknownNameError, "unknown reset option 'begin'"),
        ({"start": {"arm0": np.zeros(6)}, "goal": tucked(cell)}, MmpError, "no configuration for arm 'arm1'"),
        ({"goal": {"arm9": "home"}}, MmpError, "unknown arm 'arm9'"),
        ({"goal": {"arm0": {"pose": {"position": [0, 0]}}}}, MmpError, "goal of arm 'arm0'"),
        ({"goal": {"arm0": PoseGoal([9, 0, 0.3], free="rotation")}}, InvalidInstanceError, "goal of arm 'arm0'"),
        ({"start": through_the_table}, InvalidInstanceError, "start is in collision"),
        ({"goal": tucked(cell) | {"arm1": np.full(6, 9.0)}}, InvalidInstanceError, "goal of arm 'arm1', joint 1"),
    ]:
        with pytest.raises(error, match=message):
            env.reset(options=options)
    assert env.unwrapped.problem is before


@pytest.mark.parametrize("as_json", [False, True])
def test_options_take_tool_poses_and_an_arm_without_a_goal_stays(as_json):
    env = make()
    cell = env.unwrapped.cell
    pose = PoseGoal([0.1, 0.15, 0.3], [0, 1, 0, 0], free="z")
    start = dict.fromkeys(cell.arm_names, "tucked")
    env.reset(options={"start": start, "goal": {"arm0": goal_to_data(pose) if as_json else pose}})
    problem = env.unwrapped.problem
    np.testing.assert_array_equal(problem.goal["arm1"], problem.start["arm1"])
    assert len(problem.goals["arm0"]) > 1
    tool = env.unwrapped.data.site("arm0/flange").xpos
    assert np.linalg.norm(tool - pose.position) > 0.1
    env.unwrapped.data.qpos[:] = np.concatenate([problem.goal[name] for name in cell.arm_names])
    mujoco.mj_kinematics(env.unwrapped.model, env.unwrapped.data)
    np.testing.assert_allclose(tool, pose.position, atol=1e-6)


def test_a_bad_form_of_options_does_not_seed_the_environment():
    env, other = make(), make()
    for each in (env, other):
        each.reset(seed=3)
    with pytest.raises(MmpError, match="goal of arm 'arm0'"):
        env.reset(seed=5, options={"goal": {"arm0": {"pose": 3}}})
    np.testing.assert_array_equal(env.reset()[0]["goal_positions"], other.reset()[0]["goal_positions"])


class PosesOfTools:
    """A task that draws a height of the tool of the first arm."""

    def sample(self, cell, rng):
        start = {arm.name: arm.robot.tucked for arm in cell.arms}
        height = rng.uniform(0.3, 0.4)
        return start, {**start, "arm0": PoseGoal([0.1, 0.15, height], [0, 1, 0, 0])}


def test_a_task_may_draw_goals_that_are_no_configurations():
    env = make(task=PosesOfTools())
    env.reset(seed=2)
    problem = env.unwrapped.problem
    assert isinstance(problem.goal_asked["arm0"], PoseGoal)
    assert problem.name == "MultiArmCell-2/2"
    drawn = draw_problem(ring_cell(2), PosesOfTools(), 2)
    np.testing.assert_array_equal(drawn.goal["arm0"], problem.goal["arm0"])
    with pytest.raises(MmpError, match="no configurations; draw_problem gives the problem"):
        draw_instance(ring_cell(2), PosesOfTools(), 2)


def test_a_task_that_draws_no_goal_is_named():
    class Wrong(PosesOfTools):
        def sample(self, cell, rng):
            return {arm.name: arm.robot.tucked for arm in cell.arms}, dict.fromkeys(cell.arm_names, "attic")

    with pytest.raises(MmpError, match="task Wrong has drawn a goal: arm 'arm0': unknown named configuration 'attic'"):
        make(task=Wrong()).reset(seed=0)


@pytest.mark.parametrize("options", [["start"], [], "start", 3])
def test_reset_options_that_are_no_dict_are_refused_in_a_sentence(options):
    source = InstanceSource(ring_cell(2), "reach", 0.8)
    wanted = f"reset options are a {type(options).__name__}; they must be a dict with start, goal or both"
    with pytest.raises(MmpError, match=wanted):
        source.following(options, np.random.default_rng(0))


def test_wrong_options_leave_an_environment_with_objects_as_it_was():
    env = make(task="pick")
    env.reset(seed=0)
    cell, before, model = env.unwrapped.cell, env.unwrapped.problem, env.unwrapped.model
    for options, message in [
        ({"goal": tucked(cell) | {"arm1": np.full(6, 9.0)}}, "goal of arm 'arm1', joint 1"),
        ({"goal": None}, "reset option goal is None; it must be arm name -> joints"),
    ]:
        with pytest.raises(MmpError, match=message):
            env.unwrapped.reset(options=options)
    assert env.unwrapped.cell is cell
    assert env.unwrapped.problem is before
    assert env.unwrapped.model is model


class Drawing:
    """A task that returns a given sample."""

    def __init__(self, sample):
        self.given = sample

    def sample(self, cell, rng):
        return self.given


REST = {f"arm{k}": np.array([2.6, -2.2, 2.5, -1.9, -1.6, 0.0]) for k in range(2)}


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        (None, "task Drawing gives a NoneType; sample must give"),
        ((REST,), "gives a tuple; sample must give"),
        ((REST, REST, "ring-2"), "drawn another cell without the arms of 'ring-2'"),
        ((REST, REST, ring_cell(4)), "drawn another cell without the arms of 'ring-2'"),
        ((REST, {"arm0": REST["arm0"]}), "a goal that is not 6 finite numbers for arm 'arm1'"),
        (({**REST, "arm0": np.zeros(5)}, REST), "a start that is not 6 finite numbers for arm 'arm0'"),
        (({**REST, "arm0": np.full(6, np.nan)}, REST), "a start that is not 6 finite numbers for arm 'arm0'"),
    ],
)
def test_a_task_that_breaks_the_contract_is_named_with_its_fault(sample, message):
    with pytest.raises(MmpError, match=message):
        make(task=Drawing(sample)).reset(seed=0)


def test_a_class_instead_of_a_task_is_refused_when_the_environment_is_made():
    with pytest.raises(
        MmpError, match=r"task is .*; it must be a name \(`mmp list`\) or an object with a method sample"
    ):
        make(task=Drawing)


def test_a_task_with_objects_passes_gymnasiums_checker_and_works_in_vector_environments():
    check_env(make("MultiArmCell-2", task="packing").unwrapped)
    envs = gymnasium.make_vec("MultiArmCell-mixed-4", num_envs=2, vectorization_mode="sync", task="packing")
    observations, _ = envs.reset(seed=5)
    goal = draw_problem(find_cell("mixed-4"), "packing", 6).goal
    np.testing.assert_array_equal(observations["goal_positions"][1], np.concatenate(list(goal.values())))
    envs.close()


def test_the_margins_of_an_executed_plan_become_those_of_the_environment():
    env = MultiArmCellEnv(cell=ring_cell(2))
    env.reset(seed=5)
    asked = draw_problem(env.cell, "reach", 5, margin={"arms": 0.02})
    plan = retime(make_planner("auto").plan(asked, seed=1).plan)
    env.execute(plan)
    assert env.problem.margins.arms == 0.02
    env.close()
