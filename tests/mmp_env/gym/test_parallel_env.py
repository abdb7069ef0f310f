"""`parallel_env`: the cell as a ParallelEnv of PettingZoo, one agent per arm."""

import sys

import gymnasium
import numpy as np
import pytest

import mmp_env
from mmp_env.errors import MmpError

pettingzoo = pytest.importorskip("pettingzoo", reason="the extra `learning` is not installed")


@pytest.fixture
def env():
    env = mmp_env.parallel_env("MultiArmCell-2")
    yield env
    env.close()


def joined(parts):
    return np.concatenate(list(parts.values()))


@pytest.mark.parametrize("steps", [3, 200])
def test_the_test_of_pettingzoo_passes_over_several_episodes_of_both_ends(steps):
    from pettingzoo.test import parallel_api_test

    parallel_api_test(mmp_env.parallel_env("MultiArmCell-4", max_episode_steps=steps), num_cycles=60)


def test_the_seed_test_of_pettingzoo_passes():
    from pettingzoo.test import parallel_seed_test

    parallel_seed_test(lambda: mmp_env.parallel_env("MultiArmCell-2"), num_cycles=20)


def test_each_agent_has_its_own_part_of_what_the_cell_gives(env):
    one = gymnasium.make("MultiArmCell-2")
    observation, _ = one.reset(seed=5)
    observations, _ = env.reset(seed=5)
    assert env.agents == ["arm0", "arm1"]
    rng = np.random.default_rng(0)
    for _ in range(4):
        for key in ("joint_positions", "joint_velocities", "goal_positions"):
            assert np.array_equal(joined({a: o[key] for a, o in observations.items()}), observation[key])
        for agent, seen in observations.items():
            assert np.array_equal(seen["tool_positions"], observation["tool_positions"])
            assert env.observation_space(agent).contains(seen)
        actions = {agent: rng.uniform(-1, 1, 6).astype(np.float32) for agent in env.agents}
        observation, reward, terminated, truncated, info = one.step(joined(actions))
        observations, rewards, ended, cut, infos = env.step(dict(reversed(actions.items())))
        assert rewards == dict.fromkeys(("arm0", "arm1"), reward)
        assert ended == dict.fromkeys(("arm0", "arm1"), terminated)
        assert cut == dict.fromkeys(("arm0", "arm1"), truncated)
        assert max(i["distance_rad"] for i in infos.values()) == pytest.approx(info["distance_rad"], abs=1e-6)


def test_a_contact_is_in_the_info_of_the_arms_that_touch_and_ends_the_episode(env):
    """Both arms of the ring swing down, until something touches."""
    env.reset(seed=0)
    infos = {}
    while env.agents:
        _, _, ended, _, infos = env.step({agent: np.array([0, 1, 0, 0, 0, 0.0]) for agent in env.agents})
    assert any(ended.values())
    touching = {agent for agent, info in infos.items() if info["contacts"]}
    assert touching
    for agent in touching:
        assert all(agent in f"{contact.body_a} {contact.body_b}" for contact in infos[agent]["contacts"])


def test_after_the_end_there_is_no_agent_and_a_step_needs_a_reset():
    env = mmp_env.parallel_env("MultiArmCell-2", max_episode_steps=1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step({})
    env.reset(seed=1)
    *_, cut, _ = env.step({agent: np.zeros(6) for agent in env.agents})
    assert all(cut.values())
    assert env.agents == []
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step({})


@pytest.mark.parametrize(
    ("actions", "sentence"),
    [
        ({"arm0": np.zeros(6)}, "no action for arm1"),
        ({"arm0": np.zeros(6), "arm1": np.zeros(6), "arm2": np.zeros(6)}, "'arm2'.*arm0, arm1"),
        ({"arm0": np.zeros(6), "arm1": np.zeros(5)}, r"arm1 has the shape \(5,\); it must be \(6,\)"),
        ({"arm0": np.full(6, np.nan), "arm1": np.zeros(6)}, "nan"),
        ({"arm0": np.zeros(6), "arm1": np.ma.masked_all(6)}, "the action of arm1 is .* must be numbers from -1 to 1"),
        ({"arm0": np.zeros(6), "arm1": np.full(6, True)}, "the action of arm1 is .* must be numbers from -1 to 1"),
        ({"arm0": np.zeros(6), "arm1": [[0.0], [0.0, 0.0]]}, "the action of arm1 is .* must be numbers from -1 to 1"),
    ],
)
def test_a_bad_action_is_refused_with_a_sentence(env, actions, sentence):
    env.reset(seed=1)
    with pytest.raises(MmpError, match=sentence):
        env.step(actions)


@pytest.mark.filterwarnings("error")
def test_numbers_far_beyond_the_bounds_are_clipped_without_a_warning(env):
    env.reset(seed=1)
    env.step({agent: np.full(6, 1e300) for agent in env.agents})


@pytest.mark.parametrize("actions", [None, np.zeros((2, 6)), [np.zeros(6)] * 2], ids=["none", "array", "list"])
def test_actions_that_are_no_mapping_are_refused(env, actions):
    env.reset(seed=1)
    with pytest.raises(MmpError, match=r"actions is .* it must be a mapping of each agent to its action: arm0, arm1"):
        env.step(actions)


def test_the_events_of_the_cell_are_in_the_infos():
    env = mmp_env.parallel_env("MultiArmCell-2", events="goals", max_episode_steps=3)
    _, infos = env.reset(seed=1)
    assert [info["goals_reached"] for info in infos.values()] == [0, 0]
    *_, infos = env.step({agent: np.zeros(6) for agent in env.agents})
    assert [info["goals_reached"] for info in infos.values()] == [0, 0]
    env.close()


def test_options_are_those_of_the_environment_and_unknown_ones_are_refused():
    env = mmp_env.parallel_env("mmp_env:MultiArmCell", cell="ring-2-panda", control_mode="delta")
    assert env.action_space("arm0").shape == (7,)
    with pytest.raises(MmpError, match="control_mode"):
        mmp_env.parallel_env("MultiArmCell-2", controlmode="delta")
    with pytest.raises(MmpError, match="MultiArmCell-4"):
        mmp_env.parallel_env("MultiArmCel-4")
    with pytest.raises(MmpError, match="max_episode_steps is 0; it must be a whole number, 1 or more"):
        mmp_env.parallel_env("MultiArmCell-2", max_episode_steps=0)


def test_reset_options_set_the_instance_and_unknown_ones_are_refused(env):
    observations, _ = env.reset(
        seed=0, options={"start": {"arm0": "tucked", "arm1": "tucked"}, "goal": {"arm0": "home"}}
    )
    assert np.array_equal(observations["arm1"]["goal_positions"], observations["arm1"]["joint_positions"])
    with pytest.raises(MmpError, match="'gaol'"):
        env.reset(options={"gaol": {}})


def test_without_the_extra_one_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pettingzoo", None)
    monkeypatch.delitem(sys.modules, "mmp_env.gym.parallel_cell", raising=False)
    with pytest.raises(MmpError, match=r"pip install 'mmp-env\[learning\]'") as caught:
        mmp_env.parallel_env("MultiArmCell-2")
    assert "\n" not in str(caught.value)
