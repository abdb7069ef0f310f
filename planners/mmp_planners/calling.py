"""Calling a planner that may be anybody's: whatever it does, a result comes of it that can be relied on."""

from __future__ import annotations

import dataclasses
import traceback
from pathlib import Path

from mmp_env.errors import MmpError
from mmp_env.events import Watcher, ignore
from mmp_env.problem import Problem
from mmp_planners.planner import Planner, PlanResult, Status, StopPlanning
from mmp_planners.returned import WrongResultError, examined


def call(
    name: str, planner: Planner, problem: Problem, *, seed: int, time_limit: float, watch: Watcher = ignore
) -> PlanResult:
    """What `planner` makes of `problem`; its plan says by whom it was made, whether or not the planner wrote it there.

    A planner that raises, exits or returns what is no result has the status `error`, and `stats["message"]` says in one
    sentence what it did. One that lets `StopPlanning` through has found nothing. Misuse stays an `MmpError`, and names
    the planner.
    """
    try:
        returned = planner.plan(problem, seed=seed, time_limit=time_limit, watch=watch)
    except StopPlanning:
        return PlanResult(status=Status.TIMEOUT)
    except MmpError as error:
        raise MmpError(f"planner '{name}': {error}") from error
    except (Exception, SystemExit) as error:
        return _failed(name, f"raised {raised(error)} ({_place(error)})")
    try:
        result, _ = examined(returned, problem)
    except WrongResultError as error:
        return _failed(name, f"returned no result: {error}")
    return signed(result, name, planner, seed)


def raised(error: BaseException) -> str:
    """An exception in words, on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(": ")


def signed(result: PlanResult, name: str, planner: Planner, seed: int) -> PlanResult:
    """The result, its plan with the name, options and seed of the planner where it does not say them itself."""
    if result.plan is None or result.plan.planner:
        return result
    options = dataclasses.asdict(planner) if dataclasses.is_dataclass(planner) else {}
    signature = {"name": name, "options": options, "seed": seed}
    return dataclasses.replace(result, plan=dataclasses.replace(result.plan, planner=signature))


def _failed(name: str, what: str) -> PlanResult:
    return PlanResult(status=Status.ERROR, stats={"message": f"planner '{name}' {what}"})


def _place(error: BaseException) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(last.filename).name}, line {last.lineno}, in {last.name}"
