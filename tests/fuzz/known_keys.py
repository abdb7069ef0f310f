"""Known keys of the objects in each kind of file, written down from docs/reference and not taken from the readers.

A table maps each key of an object to the table of what is below it; lists count as their items. `*` stands for any
text in a key, and `<arm>` for the name of an arm of the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import PurePath
from typing import Any

FREE = None
"""Table of a value below which anything may be."""
VALUE: dict[str, Any] = {}
"""Table of a value that is no object."""
ARM = "<arm>"


def _values(*keys: str) -> dict[str, Any]:
    return dict.fromkeys(keys, VALUE)


_GOAL: dict[str, Any] = {"pose": _values("position", "quaternion", "free")}
_GOAL["any"] = _GOAL
_ENDS = {ARM: _GOAL}
_KEEP = {ARM: {"upright": _values("axis", "within")}}
_LIMIT = {ARM: VALUE}
_MARGINS = _values("arms", "obstacles", "self")
_SOLID = _values(
    *("name", "shape", "position", "yaw", "quaternion", "size", "radius", "length", "file", "scale", "pieces"),
    *("may_touch", "speed"),
)
_ORIGIN = _values("xyz", "rpy")
_IMPORTED = _values("source", "sha256", "importer", "root", "tip", "held")
_HULLS = {"origin": FREE, "*": _values("vertices", "radius")}
_SPHERES = {key: {"*": VALUE} for key in ("28", "fine", "exact")}
_ROBOT = {
    **_values("title", "reach", "links", "home", "tucked", "draw_limits", "default_tool", "ring_spheres"),
    **_values("ring_height", "acceleration_published", "uncovered_mm", "self_pairs_tested"),
    "joints": _values("name", "type", "axis", "lower", "upper", "velocity", "acceleration", "jerk", "effort")
    | {"origin": _ORIGIN},
    "flange": _ORIGIN,
    "approximate_sets_mm": _values("28", "fine", "exact"),
    "protrusion_mm": _values("28", "fine", "exact"),
    "self_collision_ignore": _values("28", "fine", "exact"),
    "self_pairs_ignored": _values("a", "b", "reason", "sphere_set"),
    "hull_volumes_m3": {"*": VALUE},
    "imported": _IMPORTED,
    "fingerprints": _values("robot.json", "spheres.json", "hulls.json", "*.xml"),
    "sources": FREE,
    "notes": FREE,
}
_TOOL = {
    **_values("title", "point", "opening", "mass", "state", "uncovered_mm", "self_pairs"),
    "mount": _ORIGIN,
    "joint_values": {"*": VALUE},
    "protrusion_mm": _values("28", "fine", "exact"),
    "self_collision_ignore": _values("28", "fine", "exact"),
    "imported": _IMPORTED,
    "sources": FREE,
    "notes": FREE,
}
_CARRIED = {"spheres.json": _SPHERES, "hulls.json": _HULLS, "*.xml": VALUE, "sha256": VALUE}
_CELL = {
    "name": VALUE,
    "arms": _values("name", "robot", "position", "yaw", "quaternion", "tool", "tool_state") | {"held": _SOLID},
    "obstacles": _SOLID,
    "spheres": VALUE,
    "robots": {"*": {"robot.json": _ROBOT, **_CARRIED}},
    "tools": {"*": {"tool.json": _TOOL, **_CARRIED}},
    "joints": {"names": {ARM: VALUE}, "addresses": {ARM: VALUE}, "qpos": VALUE},
}
_LIMITS = {"max_velocity": _LIMIT, "max_acceleration": _LIMIT, "max_jerk": _LIMIT, "margins": _MARGINS}
_RUN = {"planner": FREE, "stats": FREE}
_PLAN = {
    "schema": VALUE,
    "problem": {
        **_values("margin", "name"),
        "cell": _CELL,
        "start": {ARM: VALUE},
        "goal": {ARM: VALUE},
        "goal_asked": _ENDS,
        "keep": _KEEP,
        **_LIMITS,
    },
    "times": VALUE,
    **{key: {ARM: VALUE} for key in ("positions", "velocities", "accelerations")},
    **_RUN,
}
_JOBS = {
    **_values("schema", "name"),
    "cell": _CELL,
    "start": _ENDS,
    "objects": _SOLID | {"pose": _values("position", "quaternion", "yaw")},
    "jobs": _values("name", "arm", "after") | {"steps": {"move": _GOAL, **_values("line", "grasp", "release", "wait")}},
}
_SCHEDULE = {
    **_JOBS,
    **_LIMITS,
    **_values("period_s", "order", "order_past_s"),
    "trajectories": {ARM: _values("times", "positions")},
    "events": _values("time", "until", "arm", "kind", "job", "step", "object", "group")
    | {"pose": _values("position", "quaternion")},
    "proof": _MARGINS,
    **_RUN,
}
_BENCH = {
    **_values(
        "schema", "sources", "digests", "names", "hashes", "count", "seed", "time_limit_s", "robot", "task", "exact"
    ),
    **_values("memory_limit_mb", "save_plans", "version"),
    "planners": {**_values("label", "name"), "options": FREE},
    "margin": _MARGINS,
}
_RESULT = {
    **_values("instance", "planner", "seed", "status", "planning_time_s", "check_time_s", "expanded_nodes"),
    **_values("generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits", "root_conflicts"),
    **_values("cost_rad", "cost_lower_bound_rad", "makespan_s", "min_clearance_m", "bound_met", "deadline_hit"),
    **_values("plan", "version", "machine", "cell", "arms", "message", "workers", "load"),
    "margins_asked": _MARGINS,
    "margins_proved": _MARGINS,
}
_SCHEMAS = {
    "mmp-instances/1": {
        **_values("schema", "name", "source"),
        "cell": _CELL,
        "instances": {"name": VALUE, "start": _ENDS, "goal": _ENDS, "keep": _KEEP},
    },
    "mmp-plan/1": _PLAN,
    "mmp-episode/1": {**_values("schema", "name"), "plans": _PLAN},
    "mmp-jobs/1": _JOBS,
    "mmp-schedule/1": _SCHEDULE,
    "mmp-bench/1": _BENCH,
    "mmp-dataset/1": {
        "schema": VALUE,
        "settings": _values(
            *("source", "cell", "seed", "planner", "time_limit", "control_mode", "task", "robot", "version")
        )
        | {"margin": _MARGINS},
        "instances": _values("name", "seed", "outcome", "file", "steps"),
    },
}
_FILES = {
    "robot.json": _ROBOT,
    "tool.json": _TOOL,
    "spheres.json": _SPHERES,
    "hulls.json": _HULLS,
    "ends.json": _ENDS,
    "goal.json": _ENDS,
    "results.jsonl": _RESULT,
}
OPTIONS = {"--start": _GOAL, "--goal": _GOAL, "--keep": _KEEP[ARM]}
"""Option -> table of its value for one arm."""


def unknown_fields(name: str, document: Any) -> Iterator[str]:
    """Yields a sentence for each unknown key in a document, whose schema, file name or arms say its kind."""
    if not isinstance(document, dict):
        return
    table = _SCHEMAS.get(str(document.get("schema")), _FILES.get(PurePath(name).name))
    if table is None and isinstance(document.get("arms"), list):
        table = _CELL
    yield from unknown_keys(document, table, _arms(document))


def unknown_keys(value: Any, table: dict[str, Any] | None, arms: set[str]) -> Iterator[str]:
    """Yields a sentence for each key below a value that its table does not have. Without `arms` any arm is known."""
    if table is FREE:
        return
    if isinstance(value, list):
        for item in value:
            yield from unknown_keys(item, table, arms)
    elif isinstance(value, dict):
        for key, item in value.items():
            inner = [below for known, below in table.items() if _is(str(key), known, arms)]
            if inner:
                yield from unknown_keys(item, inner[0], arms)
            else:
                yield f"unknown field {key!r}"


def _is(key: str, known: str, arms: set[str]) -> bool:
    return (not arms or key in arms) if known == ARM else fnmatchcase(key, known)


def _arms(document: dict[str, Any]) -> set[str]:
    """Returns the names of the arms in the cell of a document."""
    holders = [document, document.get("problem"), document.get("cell")]
    holders += [holder.get("cell") for holder in holders if isinstance(holder, dict)]
    lists = [holder.get("arms") for holder in holders if isinstance(holder, dict)]
    return {str(arm.get("name")) for arms in lists if isinstance(arms, list) for arm in arms if isinstance(arm, dict)}
