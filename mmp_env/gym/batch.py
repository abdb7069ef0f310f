"""Steps several environments of a cell at once, in threads: MuJoCo does not hold Python's lock while it simulates."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import SyncVectorEnv
from gymnasium.vector.utils import iterate

from mmp_env.argument_checks import whole
from mmp_env.errors import UnknownNameError
from mmp_env.gym.registration import ANY_CELL, CELLS

MOST_ENVIRONMENTS = 1024
"""Largest number of environments of a batch."""


class BatchedEnv(SyncVectorEnv):
    """A vector environment of Gymnasium whose environments step in threads; `batched_env` makes one."""

    def __init__(self, makers: list[Any], threads: int) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="mmp-env")
        super().__init__([lambda make=make: _Ahead(make(), self._pool) for make in makers])

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Steps all environments, those that are over reset instead. See `gymnasium.vector.VectorEnv.step`."""
        begun: list[Any] = list(zip(self.envs, iterate(self.action_space, actions), self._autoreset_envs, strict=True))
        # Resets take longest, so they begin first: the threads then end at about the same time.
        for env, action, is_over in sorted(begun, key=lambda each: not each[2]):
            if is_over:
                env.begin_reset()
            else:
                env.begin_step(action)
        return super().step(actions)

    def close_extras(self, **kwargs: Any) -> None:
        """Closes all environments and ends the threads."""
        super().close_extras(**kwargs)
        self._pool.shutdown()


class _Ahead(gymnasium.Wrapper):
    """An environment whose next step or reset may have begun in another thread."""

    def __init__(self, env: gymnasium.Env, pool: ThreadPoolExecutor) -> None:
        super().__init__(env)
        self._pool = pool
        self._begun: Future[Any] | None = None

    def begin_step(self, action: Any) -> None:
        """Begins the next step."""
        self._begin(self.env.step, action)

    def begin_reset(self) -> None:
        """Begins the next reset, which continues the stream of instances."""
        self._begin(self.env.reset)

    def step(self, action: Any) -> Any:
        """Returns the result of the step that has begun, or makes it."""
        begun, self._begun = self._begun, None
        return self.env.step(action) if begun is None else begun.result()

    def reset(self, **kwargs: Any) -> Any:
        """Returns the result of the reset that has begun. With arguments, or if none has begun, makes one."""
        if kwargs:
            self._abandon()
        begun, self._begun = self._begun, None
        return self.env.reset(**kwargs) if begun is None else begun.result()

    def _begin(self, call: Callable[..., Any], *args: Any) -> None:
        self._abandon()
        self._begun = self._pool.submit(call, *args)

    def _abandon(self) -> None:
        """Waits for what has begun, and forgets it: nobody asked for it after another environment failed."""
        if self._begun is not None:
            wait([self._begun])
        self._begun = None


def batched_env(id: str, count: int, *, threads: int | None = None, **options: Any) -> BatchedEnv:
    """Returns several environments of a cell as one vector environment of Gymnasium, stepped in threads.

    The results are those of `gymnasium.make_vec(id, count, vectorization_mode="sync")`.

    Args:
        id: id of an environment, such as `MultiArmCell-4`; `MultiArmCell` takes `cell=`.
        count: number of environments.
        threads: number of threads; None for one of each processor core.
        **options: the options of `MultiArmCellEnv`, and `max_episode_steps`.

    Raises:
        MmpError: for an unknown id or option, or a bad value.
    """
    known = (ANY_CELL, *CELLS)
    if id not in known:
        raise UnknownNameError("environment", id, known)
    whole("count", count, 1, MOST_ENVIRONMENTS)
    if threads is not None:
        whole("threads", threads, 1, MOST_ENVIRONMENTS)
    makers = [lambda: gymnasium.make(id, disable_env_checker=True, **options)] * count
    return BatchedEnv(makers, threads or min(count, os.cpu_count() or 1))
