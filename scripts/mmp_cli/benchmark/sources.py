"""Sources of the instances of a benchmark: a file, or a task that draws them in a cell by seed."""

from __future__ import annotations

import functools
import hashlib
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from mmp_cli.arguments import LARGEST_SEED
from mmp_cli.instance_source import NamedCell, open_source
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_to_dict
from mmp_env.files.instance_file import Instance, InstanceFile
from mmp_env.files.writing import json_text
from mmp_env.gym.instances import DEFAULT_TASK, draw_problem, find_task
from mmp_env.model.cell import Cell
from mmp_env.model.goals import goal_to_data
from mmp_env.model.keep import keep_to_data
from mmp_env.model.problem import Problem
from mmp_env.model.task import Task
from mmp_env.problems.making import make_problem

DRAWN_COUNT = 50
"""Default number of instances of an environment id or a cell file."""
_HASH_DIGITS = 16
"""Number of hexadecimal digits of the hash of an instance."""


@dataclass(frozen=True, kw_only=True)
class Item:
    """An instance: its name in results, and the seed of the planners for it."""

    name: str
    seed: int


@runtime_checkable
class Instances(Protocol):
    """A source. `title` is the name of its cell in results, `digest` a hash of everything that defines its problems.

    `names` are those that its instances may have in results; one that ends with a slash stands for all that begin so.
    `hashes` has a hash of the cell and the instance for each instance of a file, in order, and nothing for instances
    that are drawn.
    """

    @property
    def title(self) -> str: ...
    @property
    def cell(self) -> Cell: ...
    @property
    def items(self) -> Sequence[Item]: ...
    @property
    def digest(self) -> str: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def hashes(self) -> tuple[str, ...]: ...
    @property
    def margin(self) -> float | Mapping[str, float] | None: ...

    def problem(self, k: int) -> Problem:
        """Returns the problem of item `k`. Raises `InvalidInstanceError`, or `MmpError` if none can be drawn."""
        ...

    def has(self, name: str, seed: int) -> bool:
        """Returns whether an instance of this name and seed may be among the items, whatever their number."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Listed:
    """The instances of a file, all planned with one seed."""

    title: str
    file: InstanceFile
    margin: float | Mapping[str, float] | None
    items: tuple[Item, ...]
    digest: str
    hashes: tuple[str, ...]

    @property
    def cell(self) -> Cell:
        return self.file.cell

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{self.cell.name}/{instance.name}" for instance in self.file.instances)

    def has(self, name: str, seed: int) -> bool:
        return name in self.names and seed == self.items[0].seed

    def problem(self, k: int) -> Problem:
        # Not the file's own `problem`, whose name contains the path of the file.
        instance = self.file.instances[k]
        return make_problem(
            self.cell,
            instance.start,
            instance.goal,
            margin=self.margin,
            name=self.items[k].name,
            keep=instance.keep or None,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn:
    """Instances that a task draws in a cell, named `name`/SEED; the seed of each is also that of the planner."""

    name: str
    title: str
    cell: Cell
    task: str
    margin: float | Mapping[str, float] | None
    items: tuple[Item, ...]
    digest: str

    @property
    def names(self) -> tuple[str, ...]:
        return (f"{self.name}/",)

    @property
    def hashes(self) -> tuple[str, ...]:
        return ()

    def has(self, name: str, seed: int) -> bool:
        return name == f"{self.name}/{seed}" and seed >= self.items[0].seed

    def problem(self, k: int) -> Problem:
        return draw_problem(
            self.cell, _task(self.task), self.items[k].seed, margin=self.margin, name=self.items[k].name
        )


def read_sources(args: Namespace) -> tuple[Instances, ...]:
    """Returns all sources of the command line. Raises `MmpError`, also for an instance that is in two of them."""
    sources = tuple(_read(Namespace(**vars(args) | {"source": source})) for source in args.sources)
    found: dict[str, str] = {}
    for name, source in zip(args.sources, sources, strict=True):
        for item in source.items:
            if item.name in found:
                raise MmpError(f"instance '{item.name}' is in both {found[item.name]} and {name}; names must differ")
        found |= {item.name: str(name) for item in source.items}
    return sources


def _read(args: Namespace) -> Listed | Drawn:
    opened = open_source(args)
    if isinstance(opened, NamedCell):
        task = args.task or DEFAULT_TASK
        _task(task)  # reports an unknown task before anything is planned
        seeds = range(args.seed, args.seed + (args.count or DRAWN_COUNT))
        if seeds[-1] > LARGEST_SEED:
            raise MmpError(
                f"--seed {args.seed} leaves no seeds for {len(seeds)} instances; the largest seed is {LARGEST_SEED}"
            )
        return Drawn(
            name=opened.name,
            title=opened.title,
            cell=opened.cell,
            task=task,
            margin=args.margin,
            items=tuple(Item(name=f"{opened.name}/{seed}", seed=seed) for seed in seeds),
            digest=_digest(opened.cell),
        )
    chosen = opened.instances[: args.count]
    data = [_instance_data(instance) for instance in opened.instances]
    return Listed(
        title=opened.cell.name,
        file=opened,
        margin=args.margin,
        items=tuple(Item(name=f"{opened.cell.name}/{instance.name}", seed=args.seed) for instance in chosen),
        digest=_digest(opened.cell, data),
        hashes=_hashes(opened.cell, data),
    )


@functools.cache
def _task(name: str) -> Task:
    """Returns the task; each process looks it up once."""
    return find_task(name)


def _instance_data(instance: Instance) -> dict[str, Any]:
    ends = {"start": instance.start, "goal": instance.goal}
    out: dict[str, Any] = {"name": instance.name} | {
        which: {name: goal_to_data(goal) for name, goal in end.items()} for which, end in ends.items()
    }
    return out | ({"keep": keep_to_data(instance.keep)} if instance.keep else {})


def _hashes(cell: Cell, instances: Sequence[dict]) -> tuple[str, ...]:
    begun, out = hashlib.sha256(json_text(cell_to_dict(cell)).encode()), []
    for instance in instances:
        whole = begun.copy()
        whole.update(json_text(instance).encode())
        out.append(whole.hexdigest()[:_HASH_DIGITS])
    return tuple(out)


def _digest(cell: Cell, instances: Sequence[dict] = ()) -> str:
    return hashlib.sha256(json_text([cell_to_dict(cell), instances]).encode()).hexdigest()
