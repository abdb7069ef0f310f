"""Calling a planner that may be anybody's: whatever it does, a result comes of it that can be relied on."""

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
    """What `planner` makes of `problem`; its plan says by whom it was made, whether or not the planner wrote it there.

    A planner that raises, exits or returns what is no result has the status `error`, and `stats["message"]` says in one
    sentence what it did. One that lets `StopPlanning` through has found nothing. Misuse stays an `MmpError`, and names
    the planner; so stays `KeyboardInterrupt`, which is the user's.

    The planner gets `problem` itself, in this process: right for planners of this package. `mmp` starts those of others
    in a process of their own, or gives them a copy.
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
        return failed(name, f"raised {in_words(error)}{_place(error)}")
    try:
        result, _ = validate_result(returned, problem)
    except StopPlanning:  # Ctrl-C at this very moment; it comes so only once
        result, _ = validate_result(returned, problem)
    except WrongResultError as error:
        return failed(name, f"returned no result: {error}")
    return with_provenance(result, name, planner, seed)


def failed(name: str, what: str) -> PlanResult:
    """The result of a planner that did `what` instead of planning."""
    return PlanResult(status=Status.ERROR, stats={"message": f"planner '{name}' {what}"})


def with_provenance(result: PlanResult, name: str, planner: Planner, seed: int) -> PlanResult:
    """The result, its plan with the name, options and seed of the planner where it does not say them itself."""
    if result.plan is None or result.plan.planner:
        return result
    signature = {"name": name, "options": _options(planner), "seed": seed}
    return dataclasses.replace(result, plan=dataclasses.replace(result.plan, planner=signature))


def _options(planner: Planner) -> dict[str, Any]:
    """The planner's fields as JSON has them, in words where it has no such values."""
    if not dataclasses.is_dataclass(planner) or isinstance(planner, type):
        return {}
    try:
        return plain(dataclasses.asdict(planner))
    except Exception:  # of a stranger's types
        return {field.name: shown(getattr(planner, field.name, None)) for field in dataclasses.fields(planner)}


def _place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno}, in {frames[-1].name})" if frames else ""
