"""Nonsense in plans, episodes and instances, by docs/reference/files.md. It shares no code with the readers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

from fuzz import goal_validator
from fuzz.cell_validator import cell_nonsense, joints_of, limits_of
from fuzz.json_values import is_name, is_number, is_positive, is_vector, missing, objects, wrong

LEAST_MARGIN_M, MOST_MARGIN_M, MOST_MARGIN_ALONE_M = 1e-12, 100.0, 200.0
MARGINS = ("arms", "obstacles", "self")
MOST_YAW = 4 * math.pi
"""Largest yaw in files that are no cell files [rad]."""
SLACK = 1e-3
"""Difference of two joint positions [rad] that no check may overlook."""
FASTEST = 1.01
"""Speed relative to the limit that no check may overlook."""


def instances_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields what is wrong with a file of instances."""
    yield from cell_nonsense(document.get("cell"))
    joints, instances = joints_of(document.get("cell")), document.get("instances")
    if not isinstance(instances, list) or not instances or len(objects(instances)) < len(instances):
        yield f"instances {str(instances)[:60]}"
    for instance in objects(instances):
        if not is_name(instance.get("name")):
            yield f"an instance named {str(instance.get('name'))[:60]!r}"
        yield from goal_validator.ends_nonsense(instance.get("start"), joints, is_start=True)
        yield from goal_validator.ends_nonsense(instance.get("goal"), joints, is_start=False)
        if instance.get("keep") is not None:
            yield from goal_validator.bounds_nonsense(instance["keep"])


def plan_nonsense(document: Any) -> Iterator[str]:
    """Yields why no reader may take a plan."""
    problem = document.get("problem") if isinstance(document, dict) else None
    if not isinstance(document, dict) or not isinstance(problem, dict):
        yield "no problem of a plan"
        return
    yield from cell_nonsense(problem.get("cell"))
    joints = joints_of(problem.get("cell"))
    for key in ("start", "goal"):
        yield from goal_validator.configurations_nonsense(key, problem.get(key), joints)
    if problem.get("goal_asked") is not None:
        yield from goal_validator.ends_nonsense(problem["goal_asked"], joints, is_start=False, are_all=False)
    if problem.get("keep") is not None:
        yield from goal_validator.bounds_nonsense(problem["keep"])
    yield from limits_nonsense(problem, joints)
    yield from _margins_nonsense(problem)
    times = document.get("times")
    if not isinstance(times, list) or not times or not all(is_number(time) for time in times):
        yield f"times {str(times)[:60]}"
        return
    if "accelerations" in document and "velocities" not in document:
        yield "accelerations without velocities"
    for key in ("positions", "velocities", "accelerations"):
        if key == "positions" or document.get(key) is not None:
            yield from rows_nonsense(key, document.get(key), joints, len(times))


def plan_violations(document: dict[str, Any]) -> Iterator[str]:
    """Yields why the checker must refute a plan that can be read."""
    problem, times = document["problem"], document["times"]
    limits = limits_of(problem["cell"])
    if times[0] != 0:
        yield f"the first time {times[0]}"
    for arm, rows in document["positions"].items():
        for end, row in (("start", rows[0]), ("goal", rows[-1])):
            if _difference(problem[end][arm], row) > SLACK:
                yield f"{end} of {arm} is another one"
        bounds = limits.get(arm) or []
        if any(
            not low - SLACK <= q <= high + SLACK for row in rows for q, (low, high) in zip(row, bounds, strict=False)
        ):
            yield f"{arm} beyond its limits"
        asked = problem["max_velocity"]
        fastest = asked[arm] if isinstance(asked, dict) else [asked] * len(rows[0])
        for (row, after), (begin, end) in zip(itertools.pairwise(rows), itertools.pairwise(times), strict=True):
            moved = zip(row, after, fastest, strict=True)
            if any(abs(to - from_) > FASTEST * speed * (end - begin) + SLACK for from_, to, speed in moved):
                yield f"{arm} too fast"


def episode_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields why no reader may take an episode."""
    plans = document.get("plans")
    if not isinstance(plans, list) or not plans:
        yield f"plans {str(plans)[:60]}"
        return
    for plan in plans:
        if not isinstance(plan, dict) or plan.get("schema") != "mmp-plan/1":
            yield "a plan without its schema"
        yield from plan_nonsense(plan)


def episode_violations(document: dict[str, Any]) -> Iterator[str]:
    """Yields why the checker must refute an episode that can be read."""
    for plan in document["plans"]:
        yield from plan_violations(plan)
    for before, after in itertools.pairwise(document["plans"]):
        ends, starts = before["positions"], after["positions"]
        if any(_difference(ends[arm][-1], starts[arm][0]) > SLACK for arm in ends if arm in starts):
            yield "a plan that begins elsewhere"


def rows_nonsense(key: str, value: Any, joints: Mapping[str, int | None], count: int) -> Iterator[str]:
    """Yields what is wrong with `count` configurations of each arm."""
    if not isinstance(value, dict) or set(value) != set(joints):
        yield f"{key} of other arms"
        return
    for arm, rows in value.items():
        if not isinstance(rows, list) or len(rows) != count:
            yield f"{key} of {arm}, not {count}"
        elif not all(is_vector(row, joints[arm]) for row in rows):
            yield f"{key} of {arm} that are no configurations"


def limits_nonsense(holder: dict[str, Any], joints: Mapping[str, int | None]) -> Iterator[str]:
    """Yields what is wrong with the limits of velocity, acceleration and jerk; that of velocity is required."""
    yield from missing(holder, "max_velocity")
    for key in ("max_velocity", "max_acceleration", "max_jerk"):
        value = holder.get(key)
        if isinstance(value, dict):
            are_good = set(value) == set(joints) and all(
                is_vector(row, joints[arm]) and all(map(is_positive, row)) for arm, row in value.items()
            )
            yield from wrong(holder, key, are_good)
        else:
            yield from wrong(holder, key, is_positive(value))


def margins_nonsense(margins: Any) -> Iterator[str]:
    """Yields what is wrong with the margins of each kind."""
    if not isinstance(margins, dict) or set(margins) != set(MARGINS):
        yield f"margins {str(margins)[:60]}"
    elif not all(is_number(margin, LEAST_MARGIN_M, MOST_MARGIN_M) for margin in margins.values()):
        yield f"margins {margins}"


def _margins_nonsense(problem: dict[str, Any]) -> Iterator[str]:
    margin, margins = problem.get("margin"), problem.get("margins")
    if not is_number(margin, LEAST_MARGIN_M, MOST_MARGIN_ALONE_M):
        yield f"margin {str(margin)[:60]}"
    if margins is not None:
        yield from margins_nonsense(margins)
        if isinstance(margins, dict) and margins.get("arms") != margin:
            yield "two margins between arms"


def _difference(a: list[float], b: list[float]) -> float:
    return max(abs(x - y) for x, y in zip(a, b, strict=True))
