"""The Gymnasium environment: its ids, observations and errors."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mmp_env
from mmp_env.errors import MmpError
from mmp_env.files.cell_source import find_cell
from mmp_env.gym.control import CONTROL_MODES
from mmp_env.gym.instances import draw_instance
from mmp_env.gym.registration import MAX_EPISODE_STEPS, RING_COUNTS
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.rings import RING_RADIUS_M, ring_cell


def make(name="MultiArmCell-2", **options):
    return gymnasium.make(name, **options)


@pytest.mark.parametrize(
    ("name", "options"),
    [("MultiArmCell-8", {})]
    + [("MultiArmCell-2", {"control_mode": mode}) for mode in sorted(CONTROL_MODES)]
    + [("MultiArmCell-2", {"robot": robot}) for robot in mmp_env.robot_names()],
)
def test_gymnasiums_checker_passes_without_a_warning(name, options):
    check_env(make(name, **options).unwrapped)


def test_the_ids_are_the_rings_and_one_for_any_cell():
    assert tuple(RING_RADIUS_M) == RING_COUNTS
    for count in RING_COUNTS:
        assert len(make(f"MultiArmCell-{count}").unwrapped.cell.arms) == count
    assert make("MultiArmCell", cell="ring-4-panda").unwrapped.cell.arms[3].robot.name == "panda"
    assert make("mmp_env:MultiArmCell-2").spec.max_episode_steps == MAX_EPISODE_STEPS


def test_importing_the_package_loads_neither_mujoco_nor_planners_nor_modules_of_commands():
    heavy = ["mujoco", "rich", "yaml", "msgspec", "mmp_planners", "mmp_tasks", "mmp_env.core", "mmp_env.gym.env"]
    heavy += ["mmp_env.version"]
    code = f"import sys, mmp_env; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_everything_that_the_package_lists_is_there():
    assert all(getattr(mmp_env, name) is not None for name in mmp_env.__all__)
    assert set(mmp_env.__all__) <= set(dir(mmp_env))
    with pytest.raises(AttributeError, match="no attribute 'Cel'"):
        _ = mmp_env.Cel


@pytest.mark.parametrize("vectorization", ["sync", "async"])
def test_vector_environments_step_and_reset(vectorization):
    envs = gymnasium.make_vec("MultiArmCell-2", num_envs=2, vectorization_mode=vectorization, max_episode_steps=3)
    observations, _ = envs.reset(seed=5)
    start, _ = draw_instance(ring_cell(2), seed=6)
    np.testing.assert_array_equal(observations["joint_positions"][1], np.concatenate(list(start.values())))
    truncations = [envs.step(np.zeros(envs.action_space.shape, np.float32))[3].tolist() for _ in range(4)]
    assert truncations == [[False, False]] * 2 + [[True, True], [False, False]]
    envs.close()


def test_problem_has_the_cell_instance_and_speed_of_the_environment():
    env = make(max_velocity=0.5)
    env.reset(seed=2)
    problem = env.unwrapped.problem
    assert problem is env.unwrapped.problem
    assert problem.cell is env.unwrapped.cell
    assert (problem.max_velocity["arm1"] == 0.5).all()


def test_step_and_problem_need_a_reset_first():
    env = make().unwrapped
    for use in (lambda: env.problem, lambda: env.step(np.zeros(12, np.float32))):
        with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
            use()


def test_executing_the_missing_plan_of_a_failed_planner_is_an_error():
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(MmpError, match="there is no plan to execute; the status of the planner's result says why"):
        env.execute(None)


def test_observations_agree_with_the_core_and_the_simulation():
    env = make("MultiArmCell-4", robot="panda", control_mode="velocity")
    env.reset(seed=1)
    env.action_space.seed(1)
    observation = env.step(env.action_space.sample())[0]
    cell = env.unwrapped.cell
    q = dict(zip(cell.arm_names, observation["joint_positions"].reshape(4, 7), strict=True))
    assert observation["clearance"] == cell.collision.clearance({name: rows[None] for name, rows in q.items()})
    tools = [cell.collision.tool_points(name, rows[None])[0] for name, rows in q.items()]
    np.testing.assert_allclose(observation["tool_positions"], tools, atol=2e-6)
    np.testing.assert_array_equal(observation["joint_positions"], env.unwrapped.data.qpos)
    np.testing.assert_array_equal(observation["joint_velocities"], env.unwrapped.data.qvel)


def test_observations_are_not_overwritten_by_later_steps():
    env = make()
    first, _ = env.reset(seed=0)
    kept = {name: values.copy() for name, values in first.items()}
    env.action_space.seed(0)
    second = env.step(env.action_space.sample())[0]
    env.reset(seed=1)
    for name, values in kept.items():
        np.testing.assert_array_equal(first[name], values)
        assert not np.shares_memory(first[name], second[name])


def test_an_arm_alone_has_a_clearance_within_bounds():
    alone = Cell(name="alone", arms=(place_arm("arm", "ur5e", [0, 0, 0], [1, 0, 0, 0]),))
    env = make("MultiArmCell", cell=alone)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    assert observation["clearance"] == 1.0


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("MultiArmCell-2", {"robot": "ur5"}, "unknown robot 'ur5'. Did you mean 'ur5e'"),
        ("MultiArmCell-2", {"task": "reech"}, "unknown task 'reech'. Did you mean 'reach'"),
        ("MultiArmCell-2", {"spheres": "coarse"}, "unknown sphere set 'coarse'"),
        ("MultiArmCell-2", {"control_mode": "torque"}, "unknown control_mode 'torque'"),
        (
            "MultiArmCell-2",
            {"contol_mode": "delta"},
            "unknown option of MultiArmCell 'contol_mode'. Did you mean 'control_mode'",
        ),
        (
            "MultiArmCell-2",
            {"max_velocity": -1.0},
            "max_velocity of arm 'arm0' must be a positive number, or 6 of them",
        ),
        ("MultiArmCell-2", {"cell": "ring-3"}, "unknown cell 'ring-3'. Did you mean"),
        ("MultiArmCell-2", {"cell": "ring-4-panda", "robot": "fr5"}, "is a ring of panda arms, but robot is 'fr5'"),
        ("MultiArmCell", {}, "needs cell="),
        ("MultiArmCell", {"cell": "nowhere.yaml"}, "nowhere.yaml cannot be read"),
    ],
)
def test_a_wrong_option_is_an_error_with_the_nearest_match(name, options, message):
    with pytest.raises(MmpError, match=message):
        make(name, **options)


def test_an_unknown_id_lists_the_existing_ids():
    with pytest.raises(gymnasium.error.NameNotFound, match="MultiArmCell-"):
        make("MultiArmCell-3")


def test_a_cell_is_given_as_an_object_by_name_or_by_file(tmp_path):
    from mmp_env.files.cell_file import cell_to_dict
    from mmp_env.files.writing import json_text

    cell = ring_cell(2, "fr5", "fine")
    path = tmp_path / "mine.json"
    path.write_text(json_text(cell_to_dict(cell)))
    assert find_cell(cell) is cell
    assert cell_to_dict(find_cell(str(path))) == cell_to_dict(cell)
    assert find_cell(path, spheres="28").spheres == "28"
    assert find_cell("ring-2-fr5", spheres="fine").name == cell.name
    cell.collision  # noqa: B018 - the compiled queries must not prevent the copies that Gymnasium makes
    env = make("MultiArmCell", cell=cell)
    env.reset(seed=0)
    assert env.spec.kwargs["cell"].name == cell.name
    assert env.unwrapped.problem.name == "ring-2-fr5/0"
    with pytest.raises(MmpError, match="already says which arms"):
        find_cell(cell, robot="panda")
