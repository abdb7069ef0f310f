"""Instances by seed: what `env.reset(seed=...)` draws, for programs that need no environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.cell import Cell
from mmp_env.errors import MmpError

DEFAULT_TASK = "reach"


@runtime_checkable
class Source(Protocol):
    """What instances are drawn from; every task is one."""

    def sample(
        self, cell: Cell, rng: np.random.Generator
    ) -> tuple[Mapping[str, Float[np.ndarray, " dof"]], Mapping[str, Float[np.ndarray, " dof"]]]: ...


def draw_instance(
    cell: Cell, task: str | Source = DEFAULT_TASK, seed: int = 0
) -> tuple[Mapping[str, Float[np.ndarray, " dof"]], Mapping[str, Float[np.ndarray, " dof"]]]:
    """Start and goal, arm name -> [dof] [rad]: the instance of `env.reset(seed=seed)` in an environment of this cell.

    Raises `MmpError` for an unknown task, a seed that is not a whole number from 0, or a cell without room.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise MmpError(f"seed is {seed!r}; it must be a whole number, 0 or more")
    from gymnasium.utils.seeding import np_random

    generator, _ = np_random(int(seed))
    return find_task(task).sample(cell, generator)


def find_task(task: str | Source) -> Source:
    """The task of that name with its default options, or the given one itself. Raises `UnknownNameError`."""
    if not isinstance(task, str):
        return task
    from mmp_tasks import registry

    return registry.make(task)
