"""The task of a benchmark: sources, planners, limits, and the units that they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from mmp_cli.benchmark.planner_variants import Variant
from mmp_cli.benchmark.sources import Instances

MOST_UNITS = 250_000
"""Largest number of units in a benchmark."""

Key: TypeAlias = tuple[str, str, int]
"""Instance, label of the planner, seed: the key of a line of results.jsonl."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One run of one planner on one instance; `instance` is its name, `source` and `item` are its indices."""

    instance: str
    planner: str
    seed: int
    source: int
    item: int

    @property
    def key(self) -> Key:
        return self.instance, self.planner, self.seed


@dataclass(frozen=True, kw_only=True)
class Examination:
    """Request to make a planner with its options."""

    planner: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Job:
    """Data that each worker gets once; a unit then needs a few numbers only."""

    sources: tuple[Instances, ...]
    variants: Mapping[str, Variant]
    time_limit_s: float
    memory_limit_mb: int
    exact: bool = False
    save_plans: bool = False

    def units(self) -> list[Unit]:
        """Returns all units. The planners of an instance follow each other, so that early results can be compared."""
        return [
            Unit(instance=item.name, planner=label, seed=item.seed, source=source, item=k)
            for source, instances in enumerate(self.sources)
            for k, item in enumerate(instances.items)
            for label in self.variants
        ]


@dataclass(frozen=True, kw_only=True)
class Result:
    """The result of a unit: its line of results.jsonl, and the text of its plan file if plans are saved."""

    line: dict[str, Any]
    plan: str | None = None


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The result of an examination: `misuse` is a mistake of the user, `fault` one of the planner."""

    misuse: str | None = None
    fault: str | None = None


@dataclass(frozen=True, kw_only=True)
class Failure:
    """A worker that ended during the task, on `machine`. `started` is False if no worker could start."""

    message: str
    machine: str
    started: bool = True


Task: TypeAlias = Unit | Examination
Answer: TypeAlias = Result | Verdict | Failure
