"""The dm_control environment: the same cell as Gymnasium's, to the last bit, behind dm_env's interface."""

import copy
import pickle
import unittest

import dm_env
import gymnasium
import numpy as np
import pytest
from dm_control.rl import control
from dm_env import specs, test_utils

import mmp_env
from mmp_env import dm
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.registration import CELLS, MAX_EPISODE_STEPS

FACING_STEEPLY, FACING_LEVEL = (np.array([np.pi, lift, 0.0, 0.0, 0.0, 0.0]) for lift in (-1.3, -0.2))
"""Configuration of a UR5e stretched out towards the centre of its ring."""


class Given:
    """A task with one instance only."""

    def __init__(self, start, goal):
        self.ends = start, goal

    def sample(self, cell, rng):
        return self.ends


@pytest.fixture
def pair():
    return dm.load("MultiArmCell-2", random=3)


def action_towards(environment, q):
    mode = environment.task.mode
    return 2 * (q - mode.lower) / (mode.upper - mode.lower) - 1


def assert_same(observation, other):
    assert observation.keys() == other.keys()
    for name in observation:
        np.testing.assert_array_equal(observation[name], other[name], name)


class TestTheContractOfDmEnv(test_utils.EnvironmentTestMixin, unittest.TestCase):
    """dm_env's own tests of an environment, with episodes that end in contacts."""

    def make_object_under_test(self):
        return dm.load("MultiArmCell-4", random=1)

    def make_action_sequence(self):
        rng = np.random.default_rng(0)
        return (rng.uniform(-1, 1, 24) for _ in range(20))


def test_it_is_an_environment_of_dm_control(pair):
    assert isinstance(pair, control.Environment)
    assert isinstance(pair, dm_env.Environment)
    assert pair.control_timestep() == pytest.approx(0.1)


@pytest.mark.parametrize("mode", ["position", "velocity", "delta"])
def test_the_same_actions_lead_to_the_same_as_in_gymnasium_to_the_last_bit(mode):
    other = gymnasium.make("MultiArmCell-4", control_mode=mode)
    environment = dm.load("MultiArmCell-4", task="reach", random=7, control_mode=mode)
    observation, _ = other.reset(seed=7)
    assert_same(environment.reset().observation, observation)
    rng, ends = np.random.default_rng(0), 0
    for _ in range(60):
        action = rng.uniform(-1, 1, 24).astype(np.float32)
        observation, reward, terminated, _, info = other.step(action)
        time_step = environment.step(action)
        assert_same(time_step.observation, observation)
        assert (time_step.reward, time_step.last()) == (reward, terminated)
        assert environment.task.contacts == info["contacts"]
        assert environment.task.distance_rad == info["distance_rad"]
        assert environment.task.is_success == info["is_success"]
        if terminated:
            ends += 1
            observation, _ = other.reset()
            time_step = environment.step(action)
            assert time_step.first()
            assert_same(time_step.observation, observation)
    assert ends > 0


@pytest.mark.parametrize("name", CELLS)
def test_seed_n_draws_the_instance_of_gymnasiums_seed_n_in_every_cell(name):
    other = gymnasium.make(name)
    other.reset(seed=11)
    problem = other.unwrapped.problem
    environment = dm.load(name, random=11)
    environment.reset()
    for arm in problem.start:
        np.testing.assert_array_equal(environment.task.start[arm], problem.start[arm])
        np.testing.assert_array_equal(environment.task.goal[arm], problem.goal[arm])
    assert environment.task.problem.max_velocity.keys() == problem.max_velocity.keys()


def test_two_environments_of_a_seed_draw_the_same_episodes_and_each_is_another():
    first, second = (dm.load("MultiArmCell-2", random=5) for _ in range(2))
    goals = []
    for _ in range(3):
        assert_same(observation := first.reset().observation, second.reset().observation)
        goals.append(tuple(observation["goal_positions"]))
    assert len(set(goals)) == 3


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
@pytest.mark.parametrize("task", ["reach", "packing"])
def test_a_copy_of_an_environment_continues_exactly_as_the_original(task, copied):
    environment = dm.load("MultiArmCell-mixed-4", task=task, random=2, control_mode="velocity")
    environment.reset()
    actions = np.random.default_rng(0).uniform(-1, 1, (6, *environment.action_spec().shape))
    for action in actions[:3]:
        environment.step(action)
    other = copied(environment)
    for action in actions[3:]:
        here, there = environment.step(action), other.step(action)
        assert_same(here.observation, there.observation)
        assert (here.reward, here.discount) == (there.reward, there.discount)
    assert other.physics.data.ptr is not environment.physics.data.ptr
    assert_same(environment.reset().observation, other.reset().observation)


def test_the_elements_have_the_names_of_the_cell(pair):
    pair.reset()
    named = pair.physics.named
    for arm, q in pair.task.start.items():
        for k, value in enumerate(q):
            assert named.data.qpos[f"{arm}/joint{k + 1}"] == value
            assert named.data.act[f"{arm}/servo{k + 1}"] == value
    assert named.data.site_xpos["arm1/flange"].shape == (3,)
    assert named.model.geom_pos["obstacle/table"].shape == (3,)


def test_the_specs_are_the_spaces_of_gymnasium(pair):
    other = gymnasium.make("MultiArmCell-2")
    action = pair.action_spec()
    assert isinstance(action, specs.BoundedArray)
    assert action.shape == other.action_space.shape
    assert set(action.minimum.ravel().tolist()) == {-1.0}
    assert set(action.maximum.ravel().tolist()) == {1.0}
    assert action.name.split("\t") == [f"arm{arm}/servo{k}" for arm in (0, 1) for k in range(1, 7)]
    observation, spaces = pair.observation_spec(), other.observation_space.spaces
    assert observation.keys() == spaces.keys()
    for name, spec in observation.items():
        assert (spec.shape, spec.dtype) == (spaces[name].shape, spaces[name].dtype)
        np.testing.assert_array_equal(spec.minimum, spaces[name].low)
        np.testing.assert_array_equal(spec.maximum, spaces[name].high)


def test_at_the_goal_the_episode_ends_with_the_bonus_and_discount_0():
    start = {f"arm{k}": mmp_env.load_robot("ur5e").tucked for k in range(2)}
    goal = {name: q + 0.05 for name, q in start.items()}
    environment = dm.load("MultiArmCell-2", task=Given(start, goal))
    environment.reset()
    time_step = environment.step(action_towards(environment, np.concatenate(list(goal.values()))))
    assert (time_step.last(), time_step.discount) == (True, 0.0)
    assert time_step.reward == pytest.approx(10.0 + 10.0 * 0.05, abs=0.1)
    assert environment.task.is_success


@pytest.mark.parametrize("counted", [True, False])
def test_an_arm_that_touches_itself_is_a_contact_unless_that_is_switched_off(counted):
    unfolded, folded = (np.array([0.0, -1.3, elbow, -1.57, 1.57, 0.0]) for elbow in (2.2, 3.0))
    start = {"arm0": unfolded, "arm1": mmp_env.load_robot("ur5e").tucked}
    environment = dm.load("MultiArmCell-2", task=Given(start, start | {"arm0": folded}), self_contacts=counted)
    environment.reset()
    both = action_towards(environment, np.concatenate([folded, start["arm1"]]))
    for _ in range(20):
        time_step = environment.step(both)
        if time_step.last():
            break
    assert {contact.body_a for contact in environment.task.contacts} == ({"arm0/upperarm"} if counted else set())
    assert (time_step.reward < -5) == counted


@pytest.mark.parametrize("ends", [True, False])
def test_a_contact_costs_its_penalty_and_ends_the_episode_unless_that_is_switched_off(ends):
    start = {"arm0": FACING_STEEPLY, "arm1": mmp_env.load_robot("ur5e").tucked}
    goal = {"arm0": FACING_LEVEL, "arm1": FACING_LEVEL}
    environment = dm.load("MultiArmCell-2", task=Given(start, goal), terminate_on_contact=ends)
    time_step = environment.reset()
    both = action_towards(environment, np.concatenate([FACING_LEVEL, FACING_LEVEL]))
    while not environment.task.contacts:
        time_step = environment.step(both)
        assert environment.physics.time() < 10
    assert time_step.reward < -5
    assert time_step.last() == ends
    assert time_step.discount == (0.0 if ends else 1.0)
    assert environment.task.contacts[0].body_a.startswith("arm")


def test_time_runs_out_with_discount_1_after_as_many_steps_as_in_gymnasium(pair):
    pair.reset()
    stay = action_towards(pair, pair.physics.data.qpos)
    steps = 0
    time_step = pair.step(stay)
    while not time_step.last():
        time_step, steps = pair.step(stay), steps + 1
    assert (steps + 1, time_step.discount) == (MAX_EPISODE_STEPS, 1.0)


def test_the_present_instance_can_be_planned():
    environment = dm.load("MultiArmCell-2", random=4, max_velocity=0.5)
    environment.reset()
    problem = environment.task.problem
    assert problem.cell is environment.task.cell
    assert {float(limit.max()) for limit in problem.max_velocity.values()} == {0.5}


def test_a_copy_of_the_physics_looks_ahead_without_touching_the_environment(pair):
    pair.reset()
    before = pair.physics.get_state()
    ahead = pair.physics.copy()
    ahead.data.ctrl[:] = 0.5
    ahead.step(50)
    assert np.abs(ahead.data.qpos - pair.physics.data.qpos).max() > 0.02
    np.testing.assert_array_equal(pair.physics.get_state(), before)


def test_diverging_physics_is_an_error_of_dm_control(pair):
    pair.reset()
    pair.physics.data.qvel[0] = np.nan
    with pytest.raises(control.PhysicsError):
        pair.step(np.zeros(12))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"source": "MultiArmCell-5"}, r"environment id 'MultiArmCell-5'\. Did you mean"),
        ({"source": "ring-9"}, "unknown cell 'ring-9'"),
        ({"task": "reech"}, "Did you mean 'reach'"),
        ({"random": -1}, "random is -1; it must be a whole number"),
        ({"random": "seven"}, "random is 'seven'"),
        ({"control_mode": "speed"}, "unknown control_mode 'speed'"),
        ({"control_rate_hz": 7}, "control_rate_hz is 7; it must divide 500"),
    ],
)
def test_a_wrong_option_is_one_sentence(options, message):
    with pytest.raises(MmpError, match=message):
        dm.load(**{"source": "MultiArmCell-2"} | options)


@pytest.mark.parametrize("action", [np.zeros(11), np.full(12, np.nan)])
def test_a_wrong_action_is_one_sentence(pair, action):
    pair.reset()
    with pytest.raises(MmpError, match="the action"):
        pair.step(action)


def test_an_unknown_name_lists_the_known_names():
    with pytest.raises(UnknownNameError, match=r"Known: .*MultiArmCell-2, .*MultiArmCell-mixed-4"):
        dm.load("MultiArmCell-3")
