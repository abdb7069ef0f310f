"""The clearances of a schedule with objects: in every window, held objects are parts of arms, the others obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mmp_env.check import KIND_RULES, check_document
from mmp_env.check.checked import Solid
from mmp_env.check.held import BODY
from mmp_env.check.lines import between, instants
from mmp_env.check.objects import ObjectWindow, State, lowest, pose_at
from mmp_env.check.report import CheckReport, Violation
from mmp_env.check.work import Work

SINK_M = 1e-3
"""Largest depth of a held object below where it lies, in the motions before a release and after a grasp [m]."""
_GEOMETRY = (*KIND_RULES.values(), "schema", "shape", "length")


def check_windows(
    plan: Mapping[str, Any], work: Work, windows: Sequence[ObjectWindow], *, exact: bool
) -> list[CheckReport]:
    """Returns a report on the clearances in each window.

    Args:
        plan: the motion of all arms in the cell without objects, as the content of a plan file.
        work: the schedule.
        windows: the windows.
        exact: as in `check_document`.
    """
    times = np.asarray(plan["times"], dtype=float)
    out = []
    for window in windows:
        at = np.concatenate([[window.begin], times[(times > window.begin) & (times < window.end)], [window.end]])
        rows = {name: motion.at(at) for name, motion in work.motions.items()}
        problem = dict(plan["problem"])
        problem |= {
            "start": {name: q[0] for name, q in rows.items()},
            "goal": {name: q[-1] for name, q in rows.items()},
        }
        problem |= {"cell": filled(problem["cell"], window), "max_acceleration": None, "max_jerk": None}
        # The times stay those of the schedule, for the report, although a plan begins at 0.
        part = dict(plan) | {"problem": problem, "times": at, "positions": rows}
        report = check_document(part, exact=exact)
        faults = tuple(fault for fault in report.violations if fault.rule in _GEOMETRY)
        out.append(replace(report, violations=faults))
    return out


def joined(whole: CheckReport, parts: Sequence[CheckReport]) -> CheckReport:
    """Returns the report on a schedule: the violations of all, and the least clearances."""
    faults = (*whole.violations, *(fault for part in parts for fault in part.violations))
    nearest = min(parts, key=lambda part: np.inf if part.found_clearance_m is None else part.found_clearance_m)
    proved = [part.proved_m for part in parts]
    kinds = {kind: [m for p in proved if p is not None and (m := p[kind]) is not None] for kind in KIND_RULES}
    least = [part.min_clearance_m for part in parts if part.min_clearance_m is not None]
    return replace(
        nearest,
        violations=faults,
        min_clearance_m=min(least) if len(least) == len(parts) else None,
        proved_m={kind: min(found, default=None) for kind, found in kinds.items()} if all(proved) else None,
        found_m={kind: min(part.found_m.get(kind, np.inf) for part in parts) for kind in KIND_RULES},
        instants=sum(part.instants for part in parts),
        may_touch=whole.may_touch,
    )


def filled(cell: Mapping[str, Any], window: ObjectWindow) -> dict[str, Any]:
    """Returns a cell, as files have it, with the objects of a window."""
    state: State = window.state
    arms = [
        dict(arm) | ({"held": _data(state.held[arm["name"]]) | {"name": BODY}} if arm["name"] in state.held else {})
        for arm in cell["arms"]
    ]
    full = {f"{arm['name']}/{BODY}" for arm in arms if arm.get("held") is not None}
    empty = {f"{arm['name']}/{BODY}" for arm in arms} - full
    obstacles = []
    for solid in [*cell.get("obstacles", []), *map(_data, state.lying.values())]:
        parts = {part for part, name in window.touching if name == solid["name"] and part not in empty}
        obstacles.append(dict(solid) | ({"may_touch": sorted({*solid.get("may_touch", []), *parts})} if parts else {}))
    return dict(cell) | {"arms": arms, "obstacles": obstacles}


def _data(solid: Solid) -> dict[str, Any]:
    """Returns a solid that is no mesh as files have it."""
    half = [float(x) for x in solid.size]
    sizes: dict[str, Any] = {"size": [2 * x for x in half]} if solid.shape == "box" else {"radius": half[0]}
    if solid.shape in ("cylinder", "capsule"):
        sizes["length"] = 2 * half[1]
    pose = {"position": solid.position.tolist(), "quaternion": solid.quaternion.tolist()}
    return {"name": solid.name, "shape": solid.shape, **sizes, **pose}


def sinking(work: Work, windows: Sequence[ObjectWindow]) -> Iterator[Violation]:
    """Yields a violation for every object that goes below where it lies while it may touch what carries it."""
    for arm in work.cell.arms:
        part = f"{arm.name}/{BODY}"
        spans: list[tuple[float, float, Solid]] = []
        for window in windows:
            if arm.name not in window.state.held or not any(each == part for each, _ in window.touching):
                continue
            solid = window.state.held[arm.name]
            if spans and spans[-1][2] is solid and spans[-1][1] == window.begin:
                spans[-1] = spans[-1][0], window.end, solid
            else:
                spans.append((window.begin, window.end, solid))
        for begin, end, solid in spans:
            yield from _sinking(work, arm, begin, end, solid)


def _sinking(work: Work, arm: Any, begin: float, end: float, solid: Solid) -> Iterator[Violation]:
    motion = work.motions[arm.name]
    at = instants(motion, (begin, end))
    origins, turns = pose_at(work, arm, at)
    size = float(np.linalg.norm(solid.position)) + float(np.linalg.norm(solid.size))
    heights = lowest(solid, origins, turns) - between(work.model, arm, motion.at(at), size)
    # It rests where an arm takes it, or puts it down, so at the begin or the end of the span.
    events = [e.begin for e in work.of_arm(arm.name) if e.kind in ("grasp", "release") and e.object == solid.name]
    rests = [h for time, h in ((begin, heights[0]), (end, heights[-1])) if any(abs(time - e) < 1e-9 for e in events)]
    if rests and heights.min() < max(rests) - SINK_M:
        yield Violation(
            rule="objects",
            message=f"'{solid.name}' goes {max(rests) - heights.min():.3g} m below where it lies",
            time_s=float(at[heights.argmin()]),
            arms=(arm.name,),
        )
