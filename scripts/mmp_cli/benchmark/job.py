"""What a benchmark is to do: sources, planners, limits, and the units that they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from mmp_cli.benchmark.sources import Instances

MOST_UNITS = 250_000
"""Largest benchmark."""

Key: TypeAlias = tuple[str, str, int]
"""Instance, label of the planner, seed: what a line of results.jsonl is known by."""


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A planner with options, under a label of its own; the label is its name where there is one of it."""

    label: str
    name: str
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One run of one planner on one instance; `instance` is what it is called, `source` and `item` where it is."""

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
    """Whether a planner can be made with its options."""

    planner: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Job:
    """All that a worker must know; it is sent to it once, and units are a few numbers after that."""

    sources: tuple[Instances, ...]
    variants: Mapping[str, Variant]
    time_limit_s: float
    memory_limit_mb: int
    exact: bool = False
    save_plans: bool = False

    def units(self) -> list[Unit]:
        """All of them; the planners of an instance follow each other, so what is there early can be compared."""
        return [
            Unit(instance=item.name, planner=label, seed=item.seed, source=source, item=k)
            for source, instances in enumerate(self.sources)
            for k, item in enumerate(instances.items)
            for label in self.variants
        ]


@dataclass(frozen=True, kw_only=True)
class Result:
    """What became of a unit: its line of results.jsonl, and the text of its plan file where plans are saved."""

    line: dict[str, Any]
    plan: str | None = None


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What became of an examination: `misuse` is the user's mistake, `fault` the planner's."""

    misuse: str | None = None
    fault: str | None = None


@dataclass(frozen=True, kw_only=True)
class Failure:
    """The worker did not survive the task; `machine` is where that was.

    `started` is False where no worker came so far as to look at the task.
    """

    message: str
    machine: str
    started: bool = True


Task: TypeAlias = Unit | Examination
Answer: TypeAlias = Result | Verdict | Failure
