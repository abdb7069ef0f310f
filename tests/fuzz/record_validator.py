"""Nonsense in settings and results of a benchmark, and in the index of a dataset; independent of the readers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fuzz.json_values import is_number, is_positive, is_whole, leaves, missing, objects, wrong

STATUSES = ("solved", "timeout", "exhausted", "invalid", "error")
LARGEST, LONGEST_TEXT = 1e12, 10_000
NOT_NEGATIVE = (
    *("planning_time_s", "check_time_s", "expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries"),
    *("fast_track_hits", "root_conflicts", "cost_rad", "cost_lower_bound_rad", "makespan_s"),
)
"""Times, counts and lengths of a result."""


def settings_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields what is wrong with the settings of a benchmark."""
    for key in ("sources", "planners"):
        yield from wrong(document, key, isinstance(document.get(key), list))
    for planner in objects(document.get("planners")):
        yield from missing(planner, "label", "name")
    for key, least in (("count", 1), ("memory_limit_mb", 1), ("seed", 0)):
        yield from wrong(document, key, is_whole(document.get(key), least))
    yield from wrong(document, "time_limit_s", is_positive(document.get("time_limit_s")))
    yield from wrong(document, "margin", all(map(is_positive, leaves(document.get("margin")))))


def result_nonsense(document: Any) -> Iterator[str]:
    """Yields what is wrong with a line of results."""
    if not isinstance(document, dict):
        yield "a result that is no object"
        return
    yield from missing(document, "instance", "planner", "status")
    yield from wrong(document, "status", document.get("status") in STATUSES)
    for key in NOT_NEGATIVE:
        yield from wrong(document, key, is_number(document.get(key), 0.0))
    yield from wrong(document, "arms", is_whole(document.get("arms"), 1))
    for leaf in leaves(document):
        if isinstance(leaf, str) and len(leaf) > LONGEST_TEXT:
            yield f"a text of {len(leaf)} characters"
        elif isinstance(leaf, int | float) and abs(leaf) > LARGEST:
            yield f"the number {leaf}"


def dataset_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields what is wrong with the index of a dataset."""
    settings, instances = document.get("settings"), document.get("instances")
    if not isinstance(settings, dict) or not isinstance(instances, list) or len(objects(instances)) < len(instances):
        yield "no settings, or no list of instances"
        return
    yield from wrong(settings, "time_limit", is_positive(settings.get("time_limit")))
    yield from wrong(settings, "seed", is_whole(settings.get("seed"), 0))
    for line in objects(instances):
        yield from missing(line, "name", "seed", "outcome")
        yield from wrong(line, "seed", is_whole(line.get("seed"), 0))
        yield from wrong(line, "steps", is_whole(line.get("steps"), 1))
        if ("file" in line) != ("steps" in line):
            yield "a file without steps, or steps without a file"
