"""The checker of schedules: the motion of all arms is safe at every instant, and every job is done as it was asked."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from mmp_env.check import check_document
from mmp_env.check.fields import UnreadableError, known, listed, member, numbers, shown
from mmp_env.check.model import CellModel
from mmp_env.check.reading import read_cell
from mmp_env.check.report import CheckReport
from mmp_env.check.work import Motion, Work, broken_rules, read_events, read_jobs

SCHEMA = "mmp-schedule/1"
_KEYS = (
    "schema",
    "name",
    "cell",
    "start",
    "max_velocity",
    "margins",
    "jobs",
    "trajectories",
    "events",
    "order",
    "proof",
    "planner",
    "stats",
)


def check_schedule_document(document: Mapping[str, Any], *, exact: bool = False) -> CheckReport:
    """Checks the content of a schedule file against every rule of plans, and against the rules of jobs.

    The arms move on the union of their times; there each trajectory is what the file says, straight between its times.

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
        if listed(document, "order", "the schedule", optional=True):
            raise UnreadableError("the schedule has an order, which this checker cannot test yet")
        report = check_document(_as_plan(document, motions), exact=exact)
        if any(violation.rule in ("schema", "shape", "finite", "times") for violation in report.violations):
            return report
        work = Work(model=CellModel(cell), motions=motions, jobs=jobs, events=events)
        return dataclasses.replace(report, violations=(*report.violations, *broken_rules(work)))
    except UnreadableError as error:
        return CheckReport(violations=(error.violation,))


def _motions(document: Mapping[str, Any], dofs: Mapping[str, int]) -> dict[str, Motion]:
    """Returns arm name -> its motion. Raises `UnreadableError`."""
    given = member(document, "trajectories", "the schedule")
    known(given, tuple(dofs), "trajectories")
    out = {}
    for name, dof in dofs.items():
        where = f"trajectory of arm '{name}'"
        data = member(given, name, "trajectories")
        known(data, ("times", "positions"), where)
        times = numbers(member(data, "times", where), (None,), f"times of {where}")
        if times.size == 0 or not np.isfinite(times).all() or (np.diff(times) <= 0).any() or times[0] != 0.0:
            raise UnreadableError(f"the times of {where} must be finite and ascend from 0", "times")
        rows = numbers(member(data, "positions", where), (times.size, dof), f"positions of {where}")
        out[name] = Motion(times=times, positions=rows)
    return out


def _as_plan(document: Mapping[str, Any], motions: Mapping[str, Motion]) -> dict[str, Any]:
    """Returns the motion of all arms as the content of a plan file that ends where it ends."""
    margins = member(document, "margins", "the schedule")
    times = np.unique(np.concatenate([motion.times for motion in motions.values()]))
    return {
        "schema": "mmp-plan/1",
        "problem": {
            "name": "",
            "cell": document["cell"],
            "start": member(document, "start", "the schedule"),
            "goal": {name: motion.positions[-1] for name, motion in motions.items()},
            "max_velocity": member(document, "max_velocity", "the schedule"),
            "margin": member(margins, "arms", "margins"),
            "margins": margins,
        },
        "times": times,
        "positions": {name: motion.at(times) for name, motion in motions.items()},
    }
