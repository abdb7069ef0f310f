"""The rules that every planner keeps. Each rule is a generator of sentences that say how a planner breaks it."""

from __future__ import annotations

import functools
import pickle
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mmp_env import check_plan
from mmp_env.errors import in_words
from mmp_env.events import Event, SolutionFound
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.files.writing import json_text, plain
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.planner import PlanResult, StopPlanning
from mmp_planners.result_validation import NUMBERS, WrongResultError, validate_result


class BrokenError(Exception):
    """Raised if a run has no result that a rule could test; the message is the sentence."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Subject:
    """A planner under test, the test problems, and their limits [s]; `make` returns a new planner."""

    make: Callable[[], Any]
    problems: tuple[Problem, ...]
    time_limit: float
    grace: float

    @functools.cached_property
    def first(self) -> list[PlanResult]:
        """Returns the result of each problem with seed 0."""
        return [self.plan(problem) for problem in self.problems]

    def plan(self, problem: Problem, **more: Any) -> PlanResult:
        """Returns the result of a new planner, with seed 0 by default."""
        planner, keywords = self.make(), {"seed": 0, "time_limit": self.time_limit} | more
        try:
            return validate_result(planner.plan(problem, **keywords), problem)[0]
        except StopPlanning:
            raise BrokenError("plan() lets StopPlanning through; it must return the best so far") from None
        except WrongResultError as error:
            raise BrokenError(f"on {_name(problem)} {error}") from error
        except (Exception, SystemExit) as error:
            arguments = ", ".join(f"{key}={value}" for key, value in keywords.items() if key != "watch")
            raise BrokenError(f"plan() raised {in_words(error)} on {_name(problem)}, {arguments}") from error


Rule = Callable[[Subject], Iterator[str]]


def _easy(subject: Subject) -> Iterator[str]:
    easy = subject.problems[0]
    result = subject.plan(easy, time_limit=float("inf"))
    if result.plan is None:
        yield f"{_name(easy)} ended with '{result.status}'"


def _valid(subject: Subject) -> Iterator[str]:
    for problem, result in zip(subject.problems, subject.first, strict=True):
        if result.plan is not None:
            for violation in check_plan(result.plan).violations:
                yield f"the checker refutes the plan of {_name(problem)}: {violation}"


def _same(subject: Subject) -> Iterator[str]:
    for problem, first in reversed(list(zip(subject.problems, subject.first, strict=True))):
        yield from _compared(problem, first, subject.plan(problem), "seed 0 again")


def _watched(subject: Subject) -> Iterator[str]:
    for problem, first in zip(subject.problems, subject.first, strict=True):
        emitted: list[Any] = []
        yield from _compared(problem, first, subject.plan(problem, watch=emitted.append), "being watched")
        for event in emitted:
            if not isinstance(event, Event):
                yield f"its watcher gets a {type(event).__name__}, which is no Event"


def _stopped(subject: Subject) -> Iterator[str]:
    for problem in subject.problems:
        for kind in (Event, SolutionFound):
            emitted: list[Event] = []
            result = subject.plan(problem, watch=functools.partial(_stop, kind, emitted))
            stopped = [k for k, event in enumerate(emitted) if isinstance(event, kind)]
            if stopped and len(emitted) > stopped[0] + 1:
                yield f"its watcher gets a {type(emitted[-1]).__name__} after it raised StopPlanning"
            if stopped and isinstance(emitted[-1], SolutionFound) and result.plan is None:
                yield f"stopped after it had emitted a plan, it ended with '{result.status}' and none"


def _stop(kind: type[Event], emitted: list[Event], event: Event) -> None:
    emitted.append(event)
    if isinstance(event, kind):
        raise StopPlanning


def _in_time(subject: Subject) -> Iterator[str]:
    for limit in (0.0, 0.05):
        for problem in subject.problems:
            begin = time.perf_counter()
            subject.plan(problem, time_limit=limit)
            late = time.perf_counter() - begin - limit
            if late > subject.grace:
                yield f"{_name(problem)} took {late:.2f} s longer than its {limit} s; allowed: {subject.grace} s"


def _honest(subject: Subject) -> Iterator[str]:
    for problem, result in zip(subject.problems, subject.first, strict=True):
        try:
            stats = plain(result.stats)
        except TypeError as error:
            yield f"the statistics cannot be written: {error}"
            continue
        for key in NUMBERS:
            value = stats.get(key)
            if value is not None and (value < 0 or value != int(value)):
                yield f"{key} is {value}; it must be a count"
        yield from _of_plan(problem, result.plan, stats)


def _of_plan(problem: Problem, plan: Plan | None, stats: Mapping[str, Any]) -> Iterator[str]:
    true = {"cost_lower_bound_rad": problem.cost_lower_bound_rad}
    true |= {"cost_rad": plan.cost_rad if plan else None, "makespan_s": plan.makespan_s if plan else None}
    for key, value in true.items():
        said = stats.get(key)
        same = said is None or (value is not None and isinstance(said, int | float) and bool(np.isclose(said, value)))
        if not same:
            yield f"{key} is {said}, but that of {_name(problem)} {'is ' + str(value) if plan else 'does not exist'}"
    said = stats.get("min_clearance_m")
    met = check_plan(plan).found_clearance_m if plan and said is not None else None
    if met is not None and not (isinstance(said, int | float) and said <= met + 1e-6):
        yield f"min_clearance_m is {said}, but {_name(problem)} comes as close as {met} m"


def _unchanged(subject: Subject) -> Iterator[str]:
    for problem in subject.problems:
        before = _text(problem)
        subject.plan(problem, seed=1)
        if _text(problem) != before:
            yield f"planning changed {_name(problem)}"


def _seeds(subject: Subject) -> Iterator[str]:
    try:
        subject.make().plan(subject.problems[0], seed=-1, time_limit=subject.time_limit)
    except ValueError:
        return
    except (Exception, SystemExit) as error:
        yield f"seed -1 raised {in_words(error)}; it must be an MmpError, or another ValueError"
        return
    yield "seed -1 is taken; it must be an MmpError, or another ValueError"


def _pickles(subject: Subject) -> Iterator[str]:
    try:
        copy = pickle.loads(pickle.dumps(subject.make()))
    except Exception as error:
        yield f"it does not go through pickle: {in_words(error)}"
        return
    again = Subject(make=lambda: copy, problems=subject.problems, time_limit=subject.time_limit, grace=subject.grace)
    yield from _compared(subject.problems[0], subject.first[0], again.plan(subject.problems[0]), "going through pickle")


def _compared(problem: Problem, one: PlanResult, other: PlanResult, what: str) -> Iterator[str]:
    """Yields how two results differ, unless a time limit ended one of them."""
    if any(result.stats.get("deadline_hit") for result in (one, other)):
        return
    if one.plan is None or other.plan is None:
        if {one.status, other.status} != {"timeout", "solved"} and one.status != other.status:
            yield f"{what} gives '{other.status}' and not '{one.status}' on {_name(problem)}"
        return
    first, second = plan_to_dict(one.plan), plan_to_dict(other.plan)
    differ = [key for key in first if json_text(first[key]) != json_text(second.get(key))]
    if differ or first.keys() != second.keys():
        yield f"{what} gives another plan of {_name(problem)}: {', '.join(differ)} differ"


def _name(problem: Problem) -> str:
    return f"'{problem.name or problem.cell.name}'"


def _text(problem: Problem) -> str:
    here = {name: np.atleast_2d(q) for name, q in problem.start.items()}
    return json_text(plan_to_dict(Plan(problem=problem, times=np.zeros(1), positions=here))["problem"])


RULES: dict[str, Rule] = {
    "an easy problem is solved, without a time limit": _easy,
    "its plans are valid": _valid,
    "the same seed gives the same plan": _same,
    "watching changes no plan": _watched,
    "a watcher that raises StopPlanning ends the run with the best so far": _stopped,
    "the time limit is kept": _in_time,
    "its statistics are true": _honest,
    "the problem stays as it is": _unchanged,
    "a negative seed is refused": _seeds,
    "it goes through pickle": _pickles,
}
