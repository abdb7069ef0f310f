"""One unit in a worker: it makes the problem, plans and checks it, and turns every outcome into a line."""

from __future__ import annotations

import copy
import dataclasses
import gc
import json
import os
import time
from collections.abc import Callable
from typing import Any

import mmp_planners
from mmp_cli.benchmark.job import Job, Result, Unit, Variant, Verdict
from mmp_cli.benchmark.result_line import line_of, read_line
from mmp_cli.outcome import Outcome
from mmp_env.check import CheckReport, check_document
from mmp_env.errors import NO_MEMORY, InvalidInstanceError, MmpError, in_words, is_out_of_memory
from mmp_env.files.reading import Location
from mmp_env.files.writing import json_text, plain
from mmp_env.model.problem import Problem
from mmp_planners import Planner, PlanResult, Status, ignore, registry
from mmp_planners.result_validation import WrongResultError, validate_result
from mmp_planners.safe_plan import with_provenance

PLANNING, CHECKING = "planning", "checking"
"""Phases that a worker reports; before the first one it prepares."""
LATE_SHARE, LATE_LEAST_S = 0.1, 1.0
"""Largest delay of a plan behind the time limit, as a share and at least [s]; a later plan is a timeout."""


class Trials:
    """The units of one worker. They share cells, planners and the last problem."""

    def __init__(self, job: Job, report_phase: Callable[[str], None]) -> None:
        self._job, self._report_phase = job, report_phase
        self._planners: dict[str, Planner | BaseException] = {}
        self._foreign = dict[str, bool]()
        self._folder = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))  # macOS has no O_PATH
        self._last: tuple[tuple[int, int], Problem | MmpError] | None = None

    def examine(self, label: str) -> Verdict:
        """Returns whether a planner can be made with its options, and otherwise whose fault that is."""
        variant = self._job.variants[label]
        try:
            registry.load(variant.name)
        except BaseException as error:
            return Verdict(fault=in_words(error))
        try:
            mmp_planners.make(variant.name, **variant.options)
        except BaseException as error:
            if isinstance(error, MmpError) and error.__cause__ is None:
                return Verdict(misuse=in_words(error))
            return Verdict(fault=in_words(error))
        return Verdict()

    def run(self, unit: Unit) -> Result:
        """Runs a unit. It raises no exception."""
        out = Outcome(
            instance=unit.instance, planner=unit.planner, seed=unit.seed, result=PlanResult(status=Status.ERROR)
        )
        try:
            out = dataclasses.replace(out, problem=self._problem(unit))
        except InvalidInstanceError as error:
            out = dataclasses.replace(out, result=PlanResult(status=Status.INVALID))
            return Result(line=line_of(self._job, unit, out, str(error)))
        except BaseException as error:
            return Result(line=line_of(self._job, unit, out, f"no problem could be made: {in_words(error)}"))
        try:
            planner = self._planner(self._job.variants[unit.planner])
        except BaseException as error:
            return Result(line=line_of(self._job, unit, out, in_words(error)))
        try:
            result = self._planned(unit, out, planner)
            # An unreadable line would make the whole file unreadable.
            read_line(json.dumps(result.line), Location("the result"))
            return result
        except MmpError as error:
            return Result(line=line_of(self._job, unit, out, in_words(error)))
        except BaseException as error:
            reason = NO_MEMORY if is_out_of_memory(error) else f"in the benchmark itself: {in_words(error)}"
            return Result(line=line_of(self._job, unit, out, reason))

    def _planned(self, unit: Unit, out: Outcome, planner: Planner) -> Result:
        problem, limit_s = out.problem, self._job.time_limit_s
        assert problem is not None
        given = self._given(unit, problem)
        gc.collect()  # so that no garbage of the last unit is collected in the planning time
        self._report_phase(PLANNING)
        returned, fault, begin = None, None, time.perf_counter()
        try:
            returned = planner.plan(given, seed=unit.seed, time_limit=limit_s, watch=ignore)
        except BaseException as error:  # SystemExit, KeyboardInterrupt and StopPlanning too: no user caused them
            fault = f"plan() raised {in_words(error)}"
        spent_s = time.perf_counter() - begin
        self._report_phase(CHECKING)
        os.fchdir(self._folder)  # the planner may have changed the folder
        out = dataclasses.replace(out, planning_time_s=spent_s)
        if fault:
            return Result(line=line_of(self._job, unit, out, fault))
        try:
            result, document = validate_result(returned, problem)
            if document is not None:
                result = with_provenance(result, self._job.variants[unit.planner].name, planner, unit.seed)
                document["planner"] = plain(result.plan.planner if result.plan else {})
        except BaseException as error:
            text = str(error) if isinstance(error, WrongResultError) else in_words(error)
            return Result(line=line_of(self._job, unit, out, text))
        if document is None:
            return Result(line=line_of(self._job, unit, dataclasses.replace(out, result=result)))
        if spent_s > limit_s + max(LATE_LEAST_S, LATE_SHARE * limit_s):
            late = PlanResult(status=Status.TIMEOUT, stats=result.stats)
            message = f"the plan came {spent_s - limit_s:.2f} s after the time limit"
            return Result(line=line_of(self._job, unit, dataclasses.replace(out, result=late), message))
        return self._checked(unit, dataclasses.replace(out, result=result), document)

    def _checked(self, unit: Unit, out: Outcome, document: dict[str, Any]) -> Result:
        begin = time.perf_counter()
        report = check_document(document)
        out = dataclasses.replace(out, check=report, check_time_s=time.perf_counter() - begin)
        reports = [("", report)]
        if self._job.exact:
            reports.append((" by the geoms", check_document(document, exact=True)))
        refuted = [_refuted(how, found) for how, found in reports if not found.valid]
        if refuted:
            # The line has no cost and no clearance; the plan file shows the fault.
            wrong = PlanResult(status=Status.ERROR, stats=out.result.stats)
            out = dataclasses.replace(out, result=wrong, check=None)
        text = json_text(document) if self._job.save_plans else None
        return Result(line=line_of(self._job, unit, out, "; ".join(refuted) or None), plan=text)

    def _given(self, unit: Unit, problem: Problem) -> Problem:
        """Returns the problem; a planner of another package gets a copy, robots included."""
        if not self._foreign[unit.planner]:
            return problem
        given = copy.deepcopy(problem)
        _ = given.cell.collision  # built before the planning time, as for the problem itself
        return given

    def _problem(self, unit: Unit) -> Problem:
        """Returns the problem, which the planners of an instance share. Raises `InvalidInstanceError` or `MmpError`."""
        place = unit.source, unit.item
        if self._last is None or self._last[0] != place:
            source = self._job.sources[unit.source]
            _ = source.cell.collision
            try:
                self._last = place, source.problem(unit.item)
            except MmpError as error:
                self._last = place, error
        found = self._last[1]
        if isinstance(found, MmpError):
            raise found
        return found

    def _planner(self, variant: Variant) -> Planner:
        """Returns a new planner for each unit. Raises the exception of its constructor, each time."""
        if variant.label not in self._planners:
            try:
                self._foreign[variant.label] = registry.is_foreign(variant.name)
                self._planners[variant.label] = mmp_planners.make(variant.name, **variant.options)
            except BaseException as error:
                self._planners[variant.label] = error
            # Loaded packages stay for ever: without them every later collection is quick.
            gc.collect()
            gc.freeze()
        first = self._planners[variant.label]
        if isinstance(first, BaseException):
            raise first
        if dataclasses.is_dataclass(first) and not isinstance(first, type):
            return dataclasses.replace(first)
        return type(first)()


def _refuted(how: str, report: CheckReport) -> str:
    first, *more = report.violations
    others = f", and {len(more)} more" if more else ""
    return f"THE CHECKER REFUTES THE PLAN{how}: {first}{others}"
