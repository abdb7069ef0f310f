"""Several tasks in a row: pick, deliver, and home. Each begins where the one before it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_env.wording import counted
from mmp_tasks import registry
from mmp_tasks.configuration_search import tucked
from mmp_tasks.grasping import Delivery


@runtime_checkable
class Deliverer(Protocol):
    """A task that delivers objects."""

    def deliver(self, cell: Cell, rng: np.random.Generator) -> Delivery:
        """Returns a delivery. Raises `MmpError` if no draw succeeds."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One task of the row: its name, its cell, and the start and goal of the arms."""

    name: str
    cell: Cell
    start: State
    goal: State

    @brief
    def __repr__(self) -> str:
        return f"{self.name}: {counted(len(self.start), 'arm')} in cell {self.cell.name}"


def stages(cell: Cell, rng: np.random.Generator, task: str = "packing") -> tuple[Stage, ...]:
    """Returns three stages: `pick` the objects from the table, deliver them, and `home` to the tucked poses.

    Only the grippers move between two stages: they take the objects, and let them down.

    Args:
        cell: a cell whose arms hold nothing.
        rng: the source of all random numbers.
        task: the delivering task, `place` or `packing`.

    Raises:
        MmpError: for a task that delivers nothing, or if no draw succeeds.
    """
    deliverer = registry.make(task)
    if not isinstance(deliverer, Deliverer):
        raise MmpError(f"task '{task}' delivers nothing; take place or packing")
    drawn = deliverer.deliver(cell, rng)
    return (
        Stage(name="pick", cell=drawn.before, start=tucked(cell), goal=drawn.grasps),
        Stage(name=task, cell=drawn.during, start=drawn.grasps, goal=drawn.releases),
        Stage(name="home", cell=drawn.after, start=drawn.releases, goal=tucked(cell)),
    )
