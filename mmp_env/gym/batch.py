"""Steps several environments of a cell at once, in threads: MuJoCo does not hold Python's lock while it simulates."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import SyncVectorEnv

from mmp_env.argument_checks import as_numbers, given, refused, whole
from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.gym.registration import known_id
from mmp_env.gym.thread_guard import ThreadGuard, one_thread_at_a_time

MOST_ENVIRONMENTS = 1024
"""Largest number of environments of a batch."""


class BatchedEnv(SyncVectorEnv):
    """A vector environment of Gymnasium whose environments step in threads; `batched_env` makes one.

    Threads share what takes long: physics, clearances and resets. All else is computed for the whole batch at once.
    One thread at a time can use a batch, as with one environment.
    """

    def __init__(self, makers: list[Any], threads: int) -> None:
        self.thread_guard = ThreadGuard()
        super().__init__(makers)
        self._cells: list[MultiArmCellEnv] = [env.unwrapped for env in self.envs]  # pyright: ignore
        self._most_steps = getattr(self.envs[0].spec, "max_episode_steps", None) or np.inf
        self._steps = np.zeros(self.num_envs, dtype=int)
        self._threads = _Threads(threads)

    @one_thread_at_a_time
    def __getstate__(self) -> dict[str, Any]:
        return vars(self)

    @one_thread_at_a_time
    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Resets all environments, or those of `options["reset_mask"]`. See `gymnasium.vector.VectorEnv.reset`.

        Raises:
            MmpError: for a bad seed, another number of seeds than environments, or bad options.
            ClosedEnvironmentError: after `close`.
        """
        self._require_open()
        if isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str):
            if len(seed) != self.num_envs:
                raise refused("seed", seed, f"a whole number from 0, or one for each of {self.num_envs} environments")
            seed = [None if each is None else whole("seed", each, 0) for each in seed]
        elif seed is not None:
            seed = whole("seed", seed, 0)
        mask = given("options", {} if options is None else options, dict, "a dict").get("reset_mask")
        if mask is not None:
            self._env_obs = [{name: rows[k].copy() for name, rows in self._seen.items()} for k in range(self.num_envs)]
        answer = super().reset(seed=seed, options=options)
        self._steps[slice(None) if mask is None else mask] = 0
        return answer

    @one_thread_at_a_time
    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Steps all environments; those that are over reset instead. See `gymnasium.vector.VectorEnv.step`.

        Raises:
            MmpError: for another number of actions than environments, or an action that is not allowed.
            ClosedEnvironmentError: after `close`.
        """
        self._require_open()
        rows = as_numbers(actions)
        if rows is None:
            raise refused("actions", actions, f"numbers from -1 to 1, one row for each of {self.num_envs} environments")
        if rows.ndim == 0 or len(rows) != self.num_envs:
            raise MmpError(
                f"actions have shape {list(rows.shape)}; expected one row for each of {self.num_envs} environments"
            )
        over = self._autoreset_envs.copy()
        going, infos = np.flatnonzero(~over).tolist(), [{}] * self.num_envs
        self._rewards[:], self._terminations[:], self._truncations[:] = 0.0, False, False

        def reset(k: int) -> Iterator[None]:
            observation, infos[k] = self.envs[k].reset()
            yield
            for name, value in observation.items():
                self._seen[name][k] = value

        # Resets take longest, so they begin first: the threads then end at about the same time.
        resets = [reset(k) for k in np.flatnonzero(over).tolist()]
        self._steps[over] = 0
        if not going:
            self._threads.run(resets)
        else:
            observations, self._rewards[going], self._terminations[going], its = MultiArmCellEnv.step_together(
                [self._cells[k] for k in going], rows[going], lambda jobs: self._threads.run([*resets, *jobs])
            )
            for name, values in observations.items():
                self._seen[name][going] = values
            for k, info in zip(going, its, strict=True):
                infos[k] = info
            self._steps[going] += 1
            self._truncations[going] = self._steps[going] >= self._most_steps
        self._autoreset_envs = self._terminations | self._truncations
        observations = {name: rows.copy() for name, rows in self._seen.items()}
        ends = self._rewards.copy(), self._terminations.copy(), self._truncations.copy()
        return observations, *ends, _together(infos)

    @one_thread_at_a_time
    def close_extras(self, **kwargs: Any) -> None:
        """Closes all environments and ends the threads."""
        super().close_extras(**kwargs)
        self._threads.end()

    @property
    def _seen(self) -> dict[str, np.ndarray]:
        return self._observations  # pyright: ignore

    def _require_open(self) -> None:
        if self.closed:
            raise gymnasium.error.ClosedEnvironmentError("the environments are closed; make others")


class _Threads:
    """The threads of a batch: that of the caller and its helpers.

    A pickled or deep copy, and a forked process, start their own.

    Args:
        count: number of threads.
    """

    def __init__(self, count: int) -> None:
        self._helpers = count - 1
        self._start()

    def __reduce__(self) -> tuple[Any, ...]:
        return _Threads, (self._helpers + 1,)

    def run(self, jobs: list[Iterator[None]]) -> None:
        """Goes through all iterators, in all threads.

        If one raises, its thread goes through no more of them. The error is raised after the other threads have ended.
        """
        if self._process != os.getpid():  # a fork copies the pool without its threads
            self._start()
        waiting = deque(jobs)
        work = partial(_work, waiting, few=2 * (self._helpers + 1))
        helping = [self._pool.submit(work) for _ in range(min(self._helpers, len(jobs) - 1))]
        try:
            work()
        finally:
            wait(helping)
        for each in helping:
            each.result()

    def end(self) -> None:
        """Ends the helpers."""
        self._pool.shutdown()

    def _start(self) -> None:
        self._process = os.getpid()
        self._pool = ThreadPoolExecutor(max(self._helpers, 1), thread_name_prefix="mmp-env")


def _work(waiting: deque[Iterator[None]], *, few: int) -> None:
    """Goes through waiting iterators until there are none, while other threads do the same.

    The last `few` of them take turns: then all threads end at about the same time.
    """
    while True:
        try:
            job = waiting.popleft()
        except IndexError:
            return
        for _ in job:
            if len(waiting) < few:
                waiting.append(job)
                break


def _together(infos: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns the infos of all environments, which have the same keys, in the form of Gymnasium's vectors."""
    out: dict[str, Any] = {}
    for name, first in infos[0].items():
        out[name] = np.empty(len(infos), dtype=object if isinstance(first, list) else type(first))
        for k, info in enumerate(infos):
            out[name][k] = info[name]
        out[f"_{name}"] = np.ones(len(infos), dtype=bool)
    return out


def batched_env(id: str, count: int, *, threads: int | None = None, **options: Any) -> BatchedEnv:
    """Returns several environments of a cell as one vector environment of Gymnasium, stepped in threads.

    The results are those of `gymnasium.make_vec(id, count, vectorization_mode="sync")`.

    Args:
        id: id of an environment, such as `MultiArmCell-4`; `MultiArmCell` takes `cell=`.
        count: number of environments.
        threads: number of threads; None for one of each processor core.
        **options: the options of `MultiArmCellEnv`, and `max_episode_steps`, where -1 means no limit.

    Raises:
        MmpError: for an unknown id or option, or a bad value.
    """
    id = known_id(id)
    whole("count", count, 1, MOST_ENVIRONMENTS)
    if threads is not None:
        whole("threads", threads, 1, MOST_ENVIRONMENTS)
    if options.get("max_episode_steps", -1) not in (None, -1):  # -1: no limit
        whole("max_episode_steps", options["max_episode_steps"], 1)
    makers = [partial(gymnasium.make, id, disable_env_checker=True, **options)] * count
    return BatchedEnv(makers, threads or min(count, os.cpu_count() or 1))
