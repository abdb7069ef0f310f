"""Calls a planner of any package and always returns a valid result."""

from __future__ import annotations

import dataclasses
import traceback
from pathlib import Path
from typing import Any

from mmp_env.errors import MmpError, in_words
from mmp_env.events import Watcher, ignore
from mmp_env.files.writing import plain
from mmp_env.model.problem import Problem
from mmp_env.wording import shown
from mmp_planners.planner import Planner, PlanResult, Status, StopPlanning
from mmp_planners.result_validation import WrongResultError, validate_result


def run_planner(
    name: str, planner: Planner, problem: Problem, *, seed: int, time_limit: float, watch: Watcher = ignore
) -> PlanResult:
    """Runs a planner and returns its result; the plan names its planner, options and seed.

    If the planner raises, exits or returns no `PlanResult`, the status is `error`, and `stats["message"]` says what it
    did. If it lets `StopPlanning` through, the status is `timeout`.

    The planner gets `problem` itself, in this process. That suits planners of this package; `mmp` gives a copy to
    planners of other packages, or starts them in a process of their own.

    Args:
        name: name of the planner.
        planner: the planner.
        problem: the problem to solve.
        seed: seed of the run.
        time_limit: time limit [s].
        watch: watcher that gets the events of the run.

    Raises:
        MmpError: if the planner refuses an argument. The message names the planner.
        KeyboardInterrupt: if the user interrupts the run.
    """
    try:
        returned = planner.plan(problem, seed=seed, time_limit=time_limit, watch=watch)
    except StopPlanning:
        return PlanResult(status=Status.TIMEOUT)
    except MmpError as error:
        raise MmpError(f"planner '{name}': {in_words(error)}") from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return failed(name, f"raised {in_words(error)}{_location(error)}")
    try:
        result, _ = validate_result(returned, problem)
    except StopPlanning:  # Ctrl-C at this moment; the signal handler raises it once
        result, _ = validate_result(returned, problem)
    except WrongResultError as error:
        return failed(name, f"returned no result: {error}")
    return with_provenance(result, name, planner, seed)


def failed(name: str, what: str) -> PlanResult:
    """Returns the result `error` of a planner that did `what` instead of planning."""
    return PlanResult(status=Status.ERROR, stats={"message": f"planner '{name}' {what}"})


def with_provenance(result: PlanResult, name: str, planner: Planner, seed: int) -> PlanResult:
    """Returns the result with name, options and seed of the planner in its plan, unless the plan has them."""
    if result.plan is None or result.plan.planner:
        return result
    signature = {"name": name, "options": _options(planner), "seed": seed}
    return dataclasses.replace(result, plan=dataclasses.replace(result.plan, planner=signature))


def _options(planner: Planner) -> dict[str, Any]:
    """Returns the planner's fields as JSON values, as text where JSON has no such value."""
    if not dataclasses.is_dataclass(planner) or isinstance(planner, type):
        return {}
    try:
        return plain(dataclasses.asdict(planner))
    except Exception:  # another package's types may raise anything
        return {field.name: shown(getattr(planner, field.name, None)) for field in dataclasses.fields(planner)}


def _location(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno}, in {frames[-1].name})" if frames else ""
