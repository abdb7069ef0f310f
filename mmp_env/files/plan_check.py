"""Hands plans to the independent checker, in the form of their files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mmp_env.argument_checks import flag
from mmp_env.check import CheckReport, Violation, check_document
from mmp_env.errors import MmpError
from mmp_env.files.plan_file import plan_to_check
from mmp_env.model.plan import Plan, how_to_plan, what_else


def check_plan(plan: Plan | Mapping[str, Any], *, exact: bool = False) -> CheckReport:
    """Checks a plan against every rule, at every instant. docs/explanation/checking.md says what is proved and how.

    The checker sees the content of the plan's file and nothing else, and shares no code with the planners.

    Args:
        plan: a `Plan`, or the content of a plan.json (schema `mmp-plan/1`).
        exact: proves that no two of MuJoCo's geoms touch, instead of the margins between spheres.

    Returns:
        A report, true if the plan is valid. A plan that cannot be read, or is something else, breaks the rule `schema`.

    Raises:
        MmpError: if `exact` is neither True nor False.
    """
    flag("exact", exact)
    if isinstance(plan, Mapping):
        return check_document(plan, exact=exact)
    if not isinstance(plan, Plan):
        allowed = f"a Plan, or the content of a plan.json, an object{how_to_plan(plan)}"
        return _unreadable(f"the plan is {what_else(plan)}; it must be {allowed}")
    try:
        document = plan_to_check(plan)
    except (MmpError, TypeError) as error:  # TypeError: a value that JSON lacks
        return _unreadable(str(error))
    return check_document(document, exact=exact)


def _unreadable(message: str) -> CheckReport:
    return CheckReport(violations=(Violation(rule="schema", message=message),))
