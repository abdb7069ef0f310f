"""The checker of schedules: the motion of all arms is safe at every instant, and every job is done as it was asked."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mmp_env.check import KIND_RULES, check_document
from mmp_env.check.checked import Solid
from mmp_env.check.fields import UnreadableError, known, listed, margin_m, member, numbers, positive, shown
from mmp_env.check.model import CellModel
from mmp_env.check.object_clearances import check_windows, joined, sinking
from mmp_env.check.objects import handle, windows
from mmp_env.check.order import Pair, broken_order
from mmp_env.check.reading import read_cell, read_objects
from mmp_env.check.report import CheckReport, Violation
from mmp_env.check.schedule_motion import Motion, proof_times
from mmp_env.check.sweep import ROUNDING_M
from mmp_env.check.work import Work, broken_rules, read_events, read_jobs

SCHEMA = "mmp-schedule/1"
PERIOD_TOLERANCE = 1e-6
"""Largest distance of a time from a multiple of the period [periods]."""
MOST_PERIODS = 10_000_000
"""Largest number of periods of a schedule."""
_PROOF_TOLERANCE_M = 1e-6
"""Excess of a stated clearance, for the rounding of planners and checker [m]."""
_KEYS = (
    "schema",
    "name",
    "cell",
    "start",
    "max_velocity",
    "max_acceleration",
    "max_jerk",
    "period_s",
    "margins",
    "objects",
    "jobs",
    "trajectories",
    "events",
    "order",
    "order_past_s",
    "proof",
    "planner",
    "stats",
)


def check_schedule_document(document: Mapping[str, Any], *, exact: bool = False) -> CheckReport:
    """Checks the content of a schedule file against every rule of plans, and against the rules of jobs.

    The arms follow the splines of their samples, and that is what the rules of plans are tested on.

    Args:
        document: content of a schedule file, schema `mmp-schedule/1`.
        exact: as in `check_document`.

    Returns:
        A report with a violation for every rule that the schedule breaks. Nothing in the document raises.
    """
    try:
        if member(document, "schema", "the schedule") != SCHEMA:
            raise UnreadableError(f"schema is {shown(document['schema'])}; this checker reads '{SCHEMA}'")
        known(document, _KEYS, "the schedule")
        cell = read_cell(member(document, "cell", "the schedule"))
        motions = _motions(document, {arm.name: arm.dof for arm in cell.arms})
        jobs = read_jobs(listed(document, "jobs", "the schedule"), cell)
        events = read_events(listed(document, "events", "the schedule"))
        pairs = _pairs(document)
        objects = read_objects(listed(document, "objects", "the schedule", optional=True))
        plan = _as_plan(document, motions)
        report = check_document(plan, exact=exact, bodies=not objects)
        if any(violation.rule in ("schema", "shape", "finite", "times") for violation in report.violations):
            return report
        work = Work(model=CellModel(cell), motions=motions, jobs=jobs, events=events)
        broken = [*broken_rules(work)]
        if any(fault.rule in ("events", "jobs") for fault in broken):
            return dataclasses.replace(report, violations=(*report.violations, *broken))
        handled = handle(work, objects)
        broken += handled.faults
        if objects and not handled.faults:
            found = windows(handled, max(motion.end for motion in motions.values()))
            broken += sinking(work, found)
            report = joined(report, check_windows(plan, work, found, exact=exact))
        broken += _untrue_clearances(document, report, exact=exact)
        if not handled.faults:
            broken += broken_order(work, pairs, _distance(document, objects), handled)
        return dataclasses.replace(report, violations=(*report.violations, *broken))
    except UnreadableError as error:
        return CheckReport(violations=(error.violation,))


def _untrue_clearances(document: Mapping[str, Any], report: CheckReport, *, exact: bool) -> Iterator[Violation]:
    """Yields a violation for each clearance in `proof` that is larger than one that the check of the spheres found.

    Margins that are not kept are violations of their own.
    """
    stated = document.get("proof") or {}
    known(stated, tuple(KIND_RULES), "proof")
    broken = {violation.rule for violation in report.violations}
    for kind, metres in stated.items():
        most = np.inf if exact or KIND_RULES[kind] in broken else report.found_m.get(kind, np.inf) + _PROOF_TOLERANCE_M
        if metres is not None and not numbers(metres, (), f"proof.{kind}") <= most:
            text = f"proof.{kind} is {metres:.6g} m, but a clearance of the motion is {most:.6g} m"
            yield Violation(rule="proof", message=text, values={"stated": metres, "found": most})


def _distance(document: Mapping[str, Any], objects: Sequence[Solid]) -> float:
    """Returns the clearance [m] between arms at any times; also that to obstacles if there are objects."""
    margins = document["margins"]
    kinds = ("arms", "obstacles") if objects else ("arms",)
    largest = max(margin_m(margins[kind], f"margins.{kind}") for kind in kinds)
    return max(largest - ROUNDING_M, ROUNDING_M)  # never 0 or less, which every contact would satisfy


def _motions(document: Mapping[str, Any], dofs: Mapping[str, int]) -> dict[str, Motion]:
    """Returns arm name -> its motion. Raises `UnreadableError`."""
    given = member(document, "trajectories", "the schedule")
    period = float(positive(member(document, "period_s", "the schedule"), "period_s"))
    known(given, tuple(dofs), "trajectories")
    out = {}
    for name, dof in dofs.items():
        where = f"trajectory of arm '{name}'"
        data = member(given, name, "trajectories")
        known(data, ("times", "positions"), where)
        times = numbers(member(data, "times", where), (None,), f"times of {where}")
        if times.size == 0 or not np.isfinite(times).all() or (np.diff(times) <= 0).any() or times[0] != 0.0:
            raise UnreadableError(f"the times of {where} must be finite and ascend from 0", "times")
        steps = times / period
        if np.abs(steps - np.round(steps)).max() > PERIOD_TOLERANCE or steps[-1] > MOST_PERIODS:
            raise UnreadableError(
                f"the times of {where} must be multiples of the period, {period:g} s, up to {MOST_PERIODS} of them",
                "times",
            )
        rows = numbers(member(data, "positions", where), (times.size, dof), f"positions of {where}")
        out[name] = Motion(times=times, positions=rows, period=period)
    return out


def _pairs(document: Mapping[str, Any]) -> list[Pair]:
    """Returns the order. Raises `UnreadableError`."""
    order = listed(document, "order", "the schedule", optional=True)
    past = numbers(document.get("order_past_s", []), (len(order),), "order_past_s")
    if not np.isfinite(past).all():
        raise UnreadableError("order_past_s holds a number that is not finite", "finite")
    out = []
    for k, pair in enumerate(order):
        names = (
            [_motion_name(name, f"pair {k} of the order") for name in pair] if isinstance(pair, list | tuple) else []
        )
        if len(names) != 2:
            raise UnreadableError(f"pair {k} of the order is {shown(pair)}; it must be two motions")
        out.append(Pair(first=names[0], second=names[1], past=float(past[k])))
    return out


def _motion_name(data: Any, where: str) -> tuple[str, int]:
    if not isinstance(data, list | tuple) or len(data) != 2:
        raise UnreadableError(f"{where} names {shown(data)}; a motion is an arm and a number")
    arm, index = data
    if not isinstance(arm, str) or isinstance(index, bool) or not isinstance(index, int):
        raise UnreadableError(f"{where} names {shown(data)}; a motion is an arm and a number")
    return arm, index


def _as_plan(document: Mapping[str, Any], motions: Mapping[str, Motion]) -> dict[str, Any]:
    """Returns the motion of all arms as the content of a plan file that ends where it ends."""
    margins = member(document, "margins", "the schedule")
    times = proof_times(list(motions.values()))
    rows = {name: motion.at(times) for name, motion in motions.items()}
    moves = np.any([(np.diff(each, axis=0) != 0).any(axis=1) for each in rows.values()], axis=0)
    kept = np.concatenate([[True], moves]) | np.concatenate([moves, [True]])
    return {
        "schema": "mmp-plan/1",
        "problem": {
            "name": "",
            "cell": document["cell"],
            "start": member(document, "start", "the schedule"),
            "goal": {name: motion.positions[-1] for name, motion in motions.items()},
            **{key: member(document, key, "the schedule") for key in ("max_velocity", "max_acceleration", "max_jerk")},
            "margin": member(margins, "arms", "margins"),
            "margins": margins,
        },
        "times": times[kept],
        "positions": {name: each[kept] for name, each in rows.items()},
    }
