"""A line of results.jsonl: the fields of the contract, and beyond them the cell, its number of arms and a message."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from mmp_cli.benchmark.job import Failure, Job, Unit
from mmp_cli.outcome import Outcome
from mmp_cli.output import shortened
from mmp_env.model.margins import asked_margins
from mmp_planners import PlanResult, Status


def line_of(job: Job, unit: Unit, outcome: Outcome, message: str | None = None) -> dict[str, Any]:
    """The line of a unit; `message` says why there is no plan where the status alone does not."""
    source = job.sources[unit.source]
    told = None if message is None else shortened(" ".join(message.split()))
    outcome = replace(outcome, asked=asked_margins(source.margin))
    return outcome.line() | {"cell": source.title, "arms": len(source.cell.arms), "message": told}


def line_of_failure(job: Job, unit: Unit, failure: Failure) -> dict[str, Any]:
    """The line of a unit that its worker did not survive."""
    outcome = Outcome(
        instance=unit.instance, planner=unit.planner, seed=unit.seed, result=PlanResult(status=Status.ERROR)
    )
    return line_of(job, unit, outcome, failure.message) | {"machine": failure.machine}
