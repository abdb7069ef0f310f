"""Hands schedules to the independent checker, in the form of their files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mmp_env.argument_checks import given
from mmp_env.check import CheckReport
from mmp_env.check.schedule import check_schedule_document
from mmp_env.work.schedule import Schedule
from mmp_env.work.schedule_file import schedule_to_dict


def check_schedule(schedule: Schedule | Mapping[str, Any], *, exact: bool = False) -> CheckReport:
    """Checks a schedule: every rule of plans at every instant, and that every job is done as it was asked.

    Args:
        schedule: a `Schedule`, or the content of a schedule file (schema `mmp-schedule/1`).
        exact: proves that no two of MuJoCo's geoms touch, instead of the margins between spheres.

    Returns:
        A report, true if the schedule is valid.

    Raises:
        MmpError: for another object.
    """
    if isinstance(schedule, Mapping):
        return check_schedule_document(schedule, exact=exact)
    allowed = "a Schedule, or the content of a schedule file, an object"
    return check_schedule_document(schedule_to_dict(given("schedule", schedule, Schedule, allowed)), exact=exact)
