"""The checker: is a plan safe at every instant? Independent of the planners and of the native core.

It imports nothing of this package but the errors and MuJoCo. It has its own reading of plan.json, takes the kinematics
from MuJoCo and the robots' MJCF, and has distances and motion bounds of its own. docs/explanation/checking.md says what
is proved and how.
"""

from __future__ import annotations

import functools
import json
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mmp_env.check.checked import CheckedPlan
from mmp_env.check.fields import UnreadableError
from mmp_env.check.geoms import GeomPairs, GeomSolids, colliding_pairs, geom_parts
from mmp_env.check.goals import goals
from mmp_env.check.items import Family
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import part_pairs
from mmp_env.check.rates import derivatives
from mmp_env.check.reading import read_cell, read_plan
from mmp_env.check.report import RULES, CheckReport, Violation
from mmp_env.check.rules import LIMIT_TOLERANCE, beyond_limits, ends, finite, length, limits, speed, times
from mmp_env.check.shortfalls import shortfall_violations
from mmp_env.check.spheres import SpherePairs, SphereSolids
from mmp_env.check.sweep import ROUNDING_M, prove_apart
from mmp_env.check.trajectory import Trajectory
from mmp_env.check.upright import upright

__all__ = ["RULES", "CheckReport", "Violation", "check_document"]

KIND_RULES = {"arms": "arm-arm", "obstacles": "arm-obstacle", "self": "self"}
"""Kind of margin -> the rule that keeps it."""
GEOM_CLEARANCE_M = 1e-6
"""Clearance [m] that an exact check proves between geoms. It is above 0, so that the proof ends."""
_WILD_RAD = 1.0
"""Distance [rad] of a hinge beyond its limits at which a motion is refused without a proof of its clearances.

The bounds on motion hold within the limits of slides, so a slide beyond them by any distance has the same effect.
"""


def check_document(document: Mapping[str, Any], *, exact: bool = False, bodies: bool = True) -> CheckReport:
    """Checks the content of a plan.json against every rule, at every instant.

    The margins of the problem are proved with the sphere set of the cell; of older files, which have no `margins`, half
    of `margin`.

    Args:
        document: content of a plan.json, schema `mmp-plan/1`. NumPy arrays may stand for lists of numbers.
        exact: proves that no two of MuJoCo's geoms touch, instead of the margins between spheres.
        bodies: whether the clearances are tested; all other rules are.

    Returns:
        A report with a violation for every rule that the plan breaks. Nothing in the document raises.
    """
    try:
        data = read_plan(document)
        cell = json.dumps(document["problem"]["cell"], sort_keys=True, default=lambda array: array.tolist())
        model, families = _families(cell, exact, threading.get_ident())
    except UnreadableError as error:
        return CheckReport(violations=(error.violation,))
    with np.errstate(all="ignore"):  # numbers that are too large or too small give values that no rule allows
        violations = list(finite(data))
        if not violations:
            violations = [v for rule in (times, length, ends, limits, speed, derivatives) for v in rule(data)]
            violations += goals(data, model)
            allowed = np.where(data.cell.slides, LIMIT_TOLERANCE, _WILD_RAD)
            if bodies and (beyond_limits(data) <= allowed).all() and not any(length(data)):
                return _swept(data, [*violations, *upright(data, model)], model, families, exact)
    return CheckReport(
        violations=tuple(violations),
        spheres=_geometry(data, exact),
        margin_m=data.margin,
        margins_m=data.margins,
        may_touch=data.cell.may_touch,
    )


@functools.lru_cache(maxsize=8)
def _families(cell: str, exact: bool, thread: int) -> tuple[CellModel, Sequence[Family]]:
    """Returns the model and the pairs of a cell; one for each thread, because MuJoCo's data are not shared."""
    read = read_cell(json.loads(cell))
    hulls = read.spheres == "exact"  # MuJoCo's geoms of such a cell are its hulls
    model = CellModel(read, hulls=hulls)
    if hulls or exact:
        parts, clouds, ids = geom_parts(model)
        tested = colliding_pairs(model, parts) if exact else part_pairs(read, parts)
        pairs = [GeomPairs(model, parts, clouds, some, ids) for some in tested.by_rule]
        return model, (*pairs, GeomSolids(model, parts, clouds, ids))
    parts, clouds = sphere_parts(model)
    pairs = [SpherePairs(model, parts, clouds, some) for some in part_pairs(model.cell, parts).by_rule]
    return model, (*pairs, SphereSolids(model, parts, clouds))


def _geometry(data: CheckedPlan, exact: bool) -> str:
    return "geoms" if exact else data.cell.spheres


def _swept(
    data: CheckedPlan, violations: list[Violation], model: CellModel, families: Sequence[Family], exact: bool
) -> CheckReport:
    required = {rule: GEOM_CLEARANCE_M if exact else data.margins[kind] for kind, rule in KIND_RULES.items()}
    result = prove_apart(model, families, Trajectory(data.times, data.positions), required)
    proved, nearest = not result.shortfalls and np.isfinite(result.proved), result.nearest
    by_kind = {kind: result.clearances[rule].proved - ROUNDING_M for kind, rule in KIND_RULES.items()}
    return CheckReport(
        violations=(*violations, *shortfall_violations(result)),
        min_clearance_m=float(result.proved) - ROUNDING_M if proved else None,
        found_clearance_m=nearest.least if nearest.touch else None,
        where=" and ".join(nearest.touch.things) if nearest.touch else "",
        time_s=nearest.time if nearest.touch else None,
        spheres=_geometry(data, exact),
        margin_m=data.margin,
        margins_m=data.margins,
        proved_m={kind: float(m) if np.isfinite(m) else None for kind, m in by_kind.items()} if proved else None,
        found_m={kind: float(result.clearances[rule].least) for kind, rule in KIND_RULES.items()},
        required_m=min(required.values()),
        instants=result.instants,
        may_touch=data.cell.may_touch,
    )
