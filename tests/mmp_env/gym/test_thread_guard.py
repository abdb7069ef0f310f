"""A second thread gets an error, and no crash, while a first one uses an environment."""

import copy
import pickle
import threading

import numpy as np
import pytest

import mmp_env
from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.gym.thread_guard import ThreadGuard
from mmp_env.model.rings import ring_cell

IN_USE = "in use by another thread; give each thread its own"


class Held:
    """Another thread that is inside a guard until the end of the `with` block."""

    def __init__(self, guard):
        self._guard, self._inside, self._over = guard, threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._hold)

    def _hold(self):
        with self._guard:
            self._inside.set()
            self._over.wait(60)

    def __enter__(self):
        self._thread.start()
        assert self._inside.wait(60)

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()


def still(env):
    """Returns a plan that keeps the arms at their start."""
    problem = env.problem
    positions = {name: np.array([q, q]) for name, q in problem.start.items()}
    return mmp_env.Plan(problem=problem, times=np.array([0.0, 0.1]), positions=positions)


CALLS = {
    "reset": lambda env: env.reset(seed=0),
    "step": lambda env: env.step(np.zeros(12)),
    "step_together": lambda env: MultiArmCellEnv.step_together([env], np.zeros((1, 12)), lambda jobs: None),
    "action_towards": lambda env: env.action_towards(np.zeros(12)),
    "execute": lambda env: env.execute(still(env)),
    "render": lambda env: env.render(),
    "close": lambda env: env.close(),
    "deepcopy": copy.deepcopy,
    "pickle": pickle.dumps,
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_a_second_thread_is_refused_while_the_first_one_is_inside(call):
    env = MultiArmCellEnv(cell=ring_cell(2))
    env.reset(seed=0)
    before = env.data.qpos.copy()
    with Held(env.thread_guard), pytest.raises(MmpError, match=IN_USE):
        call(env)
    np.testing.assert_array_equal(env.data.qpos, before)
    env.step(np.zeros(12))


BATCH_CALLS = {
    "reset": lambda batch: batch.reset(seed=0),
    "step": lambda batch: batch.step(np.zeros((2, 12))),
    "close": lambda batch: batch.close(),
}


@pytest.mark.parametrize("call", BATCH_CALLS.values(), ids=BATCH_CALLS)
def test_a_second_thread_is_refused_while_the_first_one_uses_the_batch(call):
    batch = mmp_env.batched_env("MultiArmCell-2", 2)
    batch.reset(seed=0)
    with Held(batch.thread_guard), pytest.raises(MmpError, match=IN_USE):
        call(batch)
    batch.step(np.zeros((2, 12)))
    batch.close()


def test_a_batch_is_refused_while_another_thread_uses_one_of_its_environments():
    batch = mmp_env.batched_env("MultiArmCell-2", 2)
    batch.reset(seed=0)
    with Held(batch._cells[1].thread_guard), pytest.raises(MmpError, match=IN_USE):
        batch.step(np.zeros((2, 12)))
    batch.step(np.zeros((2, 12)))
    batch.close()


def test_a_step_is_refused_to_another_thread_in_the_middle_of_a_step(monkeypatch):
    env = MultiArmCellEnv(cell=ring_cell(2))
    env.reset(seed=0)
    messages = []

    def step():
        try:
            env.step(np.zeros(12))
        except MmpError as error:
            messages.append(str(error))

    def advance(*_):
        thread = threading.Thread(target=step)
        thread.start()
        thread.join()
        yield

    monkeypatch.setattr(env, "_move", advance)
    env.step(np.zeros(12))
    assert len(messages) == 1
    assert IN_USE in messages[0]


def test_the_thread_inside_may_call_again():
    env = MultiArmCellEnv(cell=ring_cell(2))
    with env.thread_guard:
        env.reset(seed=0)
        env.step(np.zeros(12))
        assert env.execute(still(env)).duration_s > 0


def test_an_error_leaves_the_guard_free():
    env = MultiArmCellEnv(cell=ring_cell(2))
    env.reset(seed=0)
    with pytest.raises(MmpError, match="shape"):
        env.step(np.zeros(11))
    with Held(env.thread_guard):
        pass


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_the_guard_of_a_copy_is_its_own(copied):
    guard = ThreadGuard()
    with guard:
        other = copied(guard)
    with Held(guard), other:
        pass
