"""`batched_env`: what its environments return is what they return one after the other, resets included."""

import gymnasium
import numpy as np
import pytest

import mmp_env
from mmp_env.errors import MmpError, UnknownNameError

ID, COUNT = "MultiArmCell-2", 3


def test_the_results_are_those_of_one_after_the_other():
    batch = mmp_env.batched_env(ID, COUNT, threads=2, max_episode_steps=7)
    alone = gymnasium.make_vec(ID, num_envs=COUNT, vectorization_mode="sync", max_episode_steps=7)
    (first, _), (other, _) = batch.reset(seed=4), alone.reset(seed=4)
    rng = np.random.default_rng(0)
    for _ in range(18):  # over two resets
        for name, rows in first.items():
            np.testing.assert_array_equal(rows, other[name])
        actions = rng.uniform(-0.3, 0.3, (COUNT, 12)).astype(np.float32)
        first, *ends, _ = batch.step(actions)
        other, *expected, _ = alone.step(actions)
        for found, wanted in zip(ends, expected, strict=True):
            np.testing.assert_array_equal(found, wanted)
    batch.close()
    alone.close()


def test_an_exception_of_an_environment_reaches_the_caller():
    batch = mmp_env.batched_env(ID, 2)
    batch.reset(seed=0)
    with pytest.raises(MmpError, match="finite"):
        batch.step(np.full((2, 12), np.nan, dtype=np.float32))
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


def test_wrong_arguments():
    with pytest.raises(UnknownNameError, match="MultiArmCell-2"):
        mmp_env.batched_env("MultiArmCell-3", 2)
    for count in (0, -1, 10**6):
        with pytest.raises(MmpError, match="count"):
            mmp_env.batched_env(ID, count)
    with pytest.raises(MmpError, match="threads"):
        mmp_env.batched_env(ID, 2, threads=0)
    with pytest.raises(UnknownNameError, match="option"):
        mmp_env.batched_env(ID, 2, tsk="x")
