"""Tasks with objects: each episode of the dm_control environment has its own model with the drawn objects."""

import gymnasium
import numpy as np
import pytest
from dm_control.mujoco import MovableCamera
from dm_control.viewer import runtime

import mmp_planners
from mmp_env import dm
from mmp_env.errors import MmpError
from mmp_env.opengl import offscreen_backend

OBJECTS = {"pick": "obstacle/object-arm0", "place": "obstacle/tray-arm0", "packing": "obstacle/box-north"}


@pytest.fixture
def placing():
    environment = dm.load("MultiArmCell-2", task="place", random=4)
    environment.reset()
    return environment


def assert_same(observation, other):
    assert observation.keys() == other.keys()
    for name in observation:
        np.testing.assert_array_equal(observation[name], other[name], name)


@pytest.mark.parametrize(("task", "source"), [*((task, "MultiArmCell-2") for task in OBJECTS), ("packing", "mixed-4")])
def test_every_episode_is_that_of_gymnasium_objects_and_all_to_the_last_bit(task, source):
    other = gymnasium.make("MultiArmCell", cell=source.replace("MultiArmCell-2", "ring-2"), task=task)
    environment = dm.load(source, task=task, random=7)
    observation, _ = other.reset(seed=7)
    count, rng = other.action_space.shape[0], np.random.default_rng(0)
    for _ in range(2):
        assert_same(environment.reset().observation, observation)
        lying = [obstacle.name for obstacle in environment.task.cell.obstacles]
        assert lying == [obstacle.name for obstacle in other.unwrapped.cell.obstacles]
        for name in lying:
            np.testing.assert_array_equal(
                environment.physics.named.model.geom_pos[f"obstacle/{name}"],
                other.unwrapped.model.geom(f"obstacle/{name}").pos,
            )
        for _ in range(3):
            action = rng.uniform(-1, 1, count).astype(np.float32)
            seen, reward, terminated, _, info = other.step(action)
            time_step = environment.step(action)
            assert_same(time_step.observation, seen)
            assert (time_step.reward, time_step.last()) == (reward, terminated)
            assert environment.task.contacts == info["contacts"]
            if terminated:
                break
        observation, _ = other.reset()


@pytest.mark.parametrize("task", OBJECTS)
def test_objects_have_names_and_lie_elsewhere_in_the_next_episode(task):
    environment = dm.load("MultiArmCell-2", task=task, random=3)
    where = []
    for _ in range(2):
        environment.reset()
        where.append(environment.physics.named.model.geom_pos[OBJECTS[task]].copy())
    assert not np.array_equal(*where)


def test_held_objects_hang_on_the_arms_and_move_with_them(placing):
    held = placing.physics.named.data.geom_xpos["arm0/held"]
    tool = placing.physics.named.data.site_xpos["arm0/flange"]
    before, apart = held.copy(), np.linalg.norm(held - tool)
    for _ in range(3):
        placing.step(np.full(12, 0.1))
    assert np.linalg.norm(held - before) > 0.01
    assert np.linalg.norm(held - tool) == pytest.approx(apart, abs=1e-6)


def test_the_specs_are_the_same_before_and_after_objects_came(placing):
    bare = dm.load("MultiArmCell-2", task="place", random=4)
    assert bare.action_spec() == placing.action_spec()
    assert bare.observation_spec() == placing.observation_spec()


def test_an_episode_can_be_planned_and_its_plan_followed_without_a_contact(placing):
    plan = mmp_planners.make("auto").plan(placing.task.problem, seed=0, time_limit=60.0).plan
    environment = dm.load("MultiArmCell-2", task="place", random=4)
    policy, time_step, contacts = dm.follow(environment, plan), environment.reset(), []
    while not time_step.last():
        time_step = environment.step(policy(time_step))
        contacts += environment.task.contacts
    assert environment.task.is_success
    assert contacts == []
    with pytest.raises(MmpError, match=r"the plan is for another cell: .*held object"):
        policy(environment.reset())


def test_dm_controls_viewer_notices_a_new_model():
    environment = dm.load("MultiArmCell-2", task="pick", random=4)
    shown, changes, errors = runtime.Runtime(environment, None), [], []
    shown.on_physics_changed += lambda: changes.append(environment.physics.model.ngeom)
    shown.on_error += errors.append
    shown.tick(0.0, False)
    shown.restart()
    shown.tick(0.0, False)
    shown.tick(0.1, False)
    assert len(changes) == 2
    assert errors == []
    assert shown.state is runtime.State.RUNNING


def test_a_camera_sees_the_objects_of_the_present_episode(placing):
    try:
        offscreen_backend()
    except MmpError:
        with pytest.raises((RuntimeError, ImportError, AttributeError)):
            placing.physics.render(48, 64, camera_id="overview")
        return
    first = placing.physics.render(48, 64, camera_id="overview")
    placing.reset()
    assert (placing.physics.render(48, 64, camera_id="overview") != first).any()
    assert MovableCamera(placing.physics, 48, 64).render().shape == (48, 64, 3)


def test_a_copy_of_the_physics_keeps_the_objects_of_its_episode(placing):
    ahead = placing.physics.copy()
    tray = ahead.named.model.geom_pos[OBJECTS["place"]].copy()
    placing.reset()
    ahead.step(10)
    np.testing.assert_array_equal(ahead.named.model.geom_pos[OBJECTS["place"]], tray)


def test_before_the_first_episode_there_is_no_problem_and_the_cell_is_bare():
    environment = dm.load("MultiArmCell-2", task="place", random=4)
    assert [obstacle.name for obstacle in environment.task.cell.obstacles] == ["table"]
    with pytest.raises(MmpError, match="no episode has begun"):
        _ = environment.task.problem
