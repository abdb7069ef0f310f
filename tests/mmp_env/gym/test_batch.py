"""`batched_env`: what its environments return is what they return one after the other, resets included."""

import copy
import os
import pickle
import subprocess
import sys
from collections import deque

import gymnasium
import numpy as np
import pytest
from support.unchecked import unchecked

import mmp_env
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym import batch as module

ID, COUNT = "MultiArmCell-2", 3


VARIANTS = {
    "default": (ID, {}),
    "delta": (ID, {"control_mode": "delta", "terminate_on_contact": False}),
    "events": (ID, {"events": {"cart": {}, "goals": {"every_s": 0.3}}}),
    "objects": ("MultiArmCell-4", {"robot": "panda", "task": "packing"}),
}


def assert_same(found, wanted):
    assert found.keys() == wanted.keys()
    for name, rows in wanted.items():
        np.testing.assert_array_equal(found[name], rows, name)
        assert found[name].dtype == rows.dtype


@pytest.mark.parametrize(("name", "options"), VARIANTS.values(), ids=VARIANTS)
def test_the_results_are_those_of_one_after_the_other(name, options):
    options = options | {"max_episode_steps": 7}
    batch = mmp_env.batched_env(name, COUNT, threads=2, **options)
    alone = gymnasium.make_vec(name, num_envs=COUNT, vectorization_mode="sync", **options)
    first, other = batch.reset(seed=4), alone.reset(seed=4)
    assert_same(first[0], other[0])
    assert_same(first[1], other[1])
    rng = np.random.default_rng(0)
    for step in range(18):  # over two resets
        if step == 9:
            mask = np.array([False, True, False])
            first, other = (envs.reset(options={"reset_mask": mask.copy()}) for envs in (batch, alone))
            assert_same(first[0], other[0])
        actions = rng.uniform(-0.3, 0.3, batch.action_space.shape).astype(np.float32)
        first, *ends, infos = batch.step(actions)
        other, *expected, wanted = alone.step(actions)
        assert_same(first, other)
        assert_same(infos, wanted)
        for found, rows in zip(ends, expected, strict=True):
            np.testing.assert_array_equal(found, rows)
            assert found.dtype == rows.dtype
    batch.close()
    alone.close()


def test_the_last_environments_take_turns():
    def parts(name):
        for part in range(3):
            steps.append((name, part))
            yield

    for few, order in (
        (0, ["a0", "a1", "a2", "b0", "b1", "b2", "c0", "c1", "c2"]),
        (2, ["a0", "a1", "a2", "b0", "c0", "b1", "c1", "b2", "c2"]),
    ):
        steps = []
        module._work(deque(map(parts, "abc")), few=few)
        assert [f"{name}{part}" for name, part in steps] == order


def test_an_exception_of_an_environment_reaches_the_caller():
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    with pytest.raises(MmpError, match="finite"):
        batch.step(np.full((2, 12), np.nan, dtype=np.float32))
    batch.close()


@pytest.mark.parametrize(
    "actions",
    [np.ma.masked_all((2, 12)), [np.zeros(12), np.ma.masked_all(12)], [np.zeros(12), np.full(12, True)], "up"],
    ids=["masked", "masked row", "truth values", "text"],
)
def test_actions_that_are_not_all_numbers_are_refused(actions):
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    with pytest.raises(MmpError, match=r"must be numbers from -1 to 1, one row for each of 2 environments"):
        batch.step(actions)
    batch.close()


@pytest.mark.filterwarnings("error")
def test_numbers_far_beyond_the_bounds_are_clipped_without_a_warning():
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    batch.step(np.full((2, 12), 1e300))
    batch.close()


@pytest.mark.parametrize("count", [1, 3])
def test_another_number_of_actions_than_environments_is_refused(count):
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    with pytest.raises(MmpError, match=rf"shape \[{count}, 12\]; expected one row for each of 2 environments"):
        batch.step(np.zeros((count, 12), dtype=np.float32))
    batch.close()


def test_after_an_exception_a_reset_begins_afresh():
    batch = mmp_env.batched_env(ID, 2)
    wanted, _ = batch.reset(seed=3)
    actions = np.zeros((2, 12), dtype=np.float32)
    actions[0, 0] = np.nan  # the second environment steps, and nobody asks for the result
    with pytest.raises(MmpError, match="finite"):
        batch.step(actions)
    found, _ = batch.reset(seed=3)
    for name, rows in wanted.items():
        np.testing.assert_array_equal(found[name], rows)
    batch.close()


def test_rows_of_several_lengths_and_steps_after_the_end_are_refused():
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    with pytest.raises(MmpError, match="one row for each of 2 environments"):
        batch.step([[0.0], [0.0, 0.0]])
    batch.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        batch.step(np.zeros((2, 12)))
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        batch.reset()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_a_copy_of_a_batch_continues_like_the_original(copied):
    batch = mmp_env.batched_env(ID, COUNT, threads=2, max_episode_steps=3)
    batch.reset(seed=4)
    batch.step(np.full((COUNT, 12), 0.1))
    other = copied(batch)
    for _ in range(4):  # over a reset
        wanted, found = (envs.step(np.full((COUNT, 12), 0.1)) for envs in (batch, other))
        assert_same(found[0], wanted[0])
        for row, expected in zip(found[1:4], wanted[1:4], strict=True):
            np.testing.assert_array_equal(row, expected)
    batch.close()
    other.step(np.zeros((COUNT, 12)))
    other.close()


FORKED = """
import os, signal, sys
import numpy as np
import mmp_env

batch = mmp_env.batched_env("MultiArmCell-2", 2, threads=2)
batch.reset(seed=0)
action = np.full((2, 12), 0.1)
batch.step(action)
child = os.fork()
if child == 0:
    signal.alarm(60)  # ends a child that hangs
observation = batch.step(action)[0]["joint_positions"]
if child == 0:
    batch.close()
    sys.exit(0 if np.isfinite(observation).all() else 3)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_batch_steps_in_a_forked_process():
    done = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("seed", ["3", 1.5, -1, True, [1], [1, 2, 3], [0, -1], [0, "x"]])
def test_a_bad_seed_is_refused(seed):
    batch = mmp_env.batched_env(ID, 2)
    with pytest.raises(MmpError, match=r"^seed is"):
        batch.reset(seed=seed)
    batch.close()


def test_options_that_are_no_dict_are_refused():
    batch = mmp_env.batched_env(ID, 2)
    with unchecked(), pytest.raises(MmpError, match=r"options is \[{}, {}\]; it must be a dict"):
        batch.reset(options=[{}, {}])
    batch.close()


@pytest.mark.parametrize("seed", [[3, 4], (3, 4), np.array([3, 4])], ids=["list", "tuple", "array"])
def test_seeds_of_each_environment_are_those_that_follow_one_seed(seed):
    batch = mmp_env.batched_env(f"mmp_env:{ID}", 2)
    wanted = batch.reset(seed=3)[0]
    assert_same(batch.reset(seed=seed)[0], wanted)
    batch.close()


def test_wrong_arguments():
    for steps in (0, -2, 2.5, "7"):
        with pytest.raises(MmpError, match="max_episode_steps"):
            mmp_env.batched_env(ID, 2, max_episode_steps=steps)
    with pytest.raises(UnknownNameError, match="MultiArmCell-2"):
        mmp_env.batched_env("MultiArmCell-3", 2)
    for count in (0, -1, 10**6):
        with pytest.raises(MmpError, match="count"):
            mmp_env.batched_env(ID, count)
    with pytest.raises(MmpError, match="threads"):
        mmp_env.batched_env(ID, 2, threads=0)
    with pytest.raises(UnknownNameError, match="option"):
        mmp_env.batched_env(ID, 2, tsk="x")
