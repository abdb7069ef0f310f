"""Tasks in a row: pick, deliver, and home; each begins where the one before it ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.wording import counted
from mmp_tasks import registry
from mmp_tasks.grasping import Deliverer
from mmp_tasks.stances import tucked
from mmp_tasks.task import State


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One of the row: its name, the cell as it is meanwhile, and where the arms come from and go to."""

    name: str
    cell: Cell
    start: State
    goal: State

    @brief
    def __repr__(self) -> str:
        return f"{self.name}: {counted(len(self.start), 'arm')} in cell {self.cell.name}"


def stages(cell: Cell, rng: np.random.Generator, task: str = "packing") -> tuple[Stage, ...]:
    """`pick` the objects from the table, `task` (`place` or `packing`), and `home`: back to the tucked poses.

    Between two stages nothing moves but the grippers: what was over its object has it in the tool, and what was held
    is let down. Raises `MmpError` for a task that delivers nothing, and where no draw succeeds.
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
