"""The checker: is a plan safe at every instant? Independent of the planners and of the native core.

It shares no geometry with them: MuJoCo's kinematics from the robots' MJCF, distances and motion bounds of its own, and
its own reading of plan.json. docs/explanation/checking.md says what is proved and how.
"""

from __future__ import annotations

import functools
import json
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mmp_env.check.contacts import contact_violations
from mmp_env.check.fields import UnreadableError
from mmp_env.check.geoms import GeomPairs, GeomSolids, colliding_pairs, geom_parts
from mmp_env.check.items import Family
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import part_pairs
from mmp_env.check.path import Path
from mmp_env.check.rates import derivatives
from mmp_env.check.reading import PlanData, read_cell, read_plan
from mmp_env.check.report import RULES, CheckReport, Violation
from mmp_env.check.rules import beyond_limits, ends, finite, length, limits, speed, times
from mmp_env.check.spheres import CloudPairs, CloudSolids
from mmp_env.check.sweep import ROUNDING_M, prove_apart
from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan, how_to_plan, what_else

__all__ = ["RULES", "CheckReport", "Violation", "check_plan"]

KIND_RULES = {"arms": "arm-arm", "obstacles": "arm-obstacle", "self": "self"}
"""Kind of margin -> the rule that keeps it."""
GEOM_CLEARANCE_M = 1e-6
"""What an exact check proves between geoms: that they are apart, and by a little, so that the proof ends."""
_WILD_RAD = 1.0
"""This far beyond its limits a motion is not swept any more, which would add nothing."""


def check_plan(plan: Plan | Mapping[str, Any], *, exact: bool = False) -> CheckReport:
    """Checks a plan, or the content of a plan.json, against every rule; never raises for what is wrong with the plan.

    The problem's margins are proved for all instants with the cell's sphere set; of an older plan without `margins`,
    half of its `margin`. With `exact` MuJoCo's geoms take the place of the spheres, and that no two of them touch is
    proved.
    """
    try:
        document = _document(plan)
        data = read_plan(document)
        cell = json.dumps(document["problem"]["cell"], sort_keys=True, default=lambda array: array.tolist())
        model, families = _families(cell, exact, threading.get_ident())
    except UnreadableError as error:
        return CheckReport(violations=(error.violation,))
    with np.errstate(all="ignore"):  # of numbers that are too large or too small: what comes out, no rule allows
        violations = list(finite(data))
        if not violations:
            violations = [v for rule in (times, length, ends, limits, speed, derivatives) for v in rule(data)]
            if beyond_limits(data).max() <= _WILD_RAD and not any(length(data)):
                return _swept(data, violations, model, families, exact)
    return CheckReport(
        violations=tuple(violations), spheres=_geometry(data, exact), margin_m=data.margin, margins_m=data.margins
    )


def _document(plan: Plan | Mapping[str, Any]) -> Any:
    if isinstance(plan, Mapping):
        return plan
    if not isinstance(plan, Plan):
        allowed = f"a Plan, or the content of a plan.json, an object{how_to_plan(plan)}"
        raise UnreadableError(f"the plan is {what_else(plan)}; it must be {allowed}")
    from mmp_env.files.plan_file import plan_to_dict

    try:
        return plan_to_dict(plan)
    except MmpError as error:
        raise UnreadableError(str(error)) from None


@functools.lru_cache(maxsize=8)
def _families(cell: str, exact: bool, thread: int) -> tuple[CellModel, Sequence[Family]]:
    """What a cell's plans are checked with; not shared between threads, because MuJoCo's data are not."""
    model = CellModel(read_cell(json.loads(cell)))
    if exact:
        parts, clouds, ids = geom_parts(model)
        pairs = [GeomPairs(model, parts, clouds, some, ids) for some in colliding_pairs(model, parts).by_rule]
        return model, (*pairs, GeomSolids(model, parts, clouds, ids))
    parts, clouds = sphere_parts(model)
    pairs = [CloudPairs(model, parts, clouds, some) for some in part_pairs(model.cell, parts).by_rule]
    return model, (*pairs, CloudSolids(model, parts, clouds))


def _geometry(data: PlanData, exact: bool) -> str:
    return "geoms" if exact else data.cell.spheres


def _swept(
    data: PlanData, violations: list[Violation], model: CellModel, families: Sequence[Family], exact: bool
) -> CheckReport:
    required = {rule: GEOM_CLEARANCE_M if exact else data.margins[kind] for kind, rule in KIND_RULES.items()}
    result = prove_apart(model, families, Path(data.times, data.positions), required)
    proved, nearest = not result.contacts and np.isfinite(result.proved), result.nearest
    by_kind = {kind: result.clearances[rule].proved - ROUNDING_M for kind, rule in KIND_RULES.items()}
    return CheckReport(
        violations=(*violations, *contact_violations(result)),
        min_clearance_m=float(result.proved) - ROUNDING_M if proved else None,
        found_clearance_m=nearest.least if nearest.touch else None,
        where=" and ".join(nearest.touch.things) if nearest.touch else "",
        time_s=nearest.time if nearest.touch else None,
        spheres=_geometry(data, exact),
        margin_m=data.margin,
        margins_m=data.margins,
        proved_m={kind: float(m) if np.isfinite(m) else None for kind, m in by_kind.items()} if proved else None,
        required_m=min(required.values()),
        instants=result.instants,
    )
