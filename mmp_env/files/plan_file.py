"""Plan files, schema `mmp-plan/1`: self-contained, the same bytes for the same plan (docs/reference/files.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import given, require_finite
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import CellData, cell_from_data, cell_to_dict
from mmp_env.files.file_kinds import PLAN, read_for
from mmp_env.files.instance_file import check_arms, configurations_from_dict, goals_from_dict
from mmp_env.files.reading import (
    MAX_PLAN_BYTES,
    MOST_PLAN_COLLECTIONS,
    Location,
    decode_file,
    numbers,
)
from mmp_env.files.writing import json_text, plain, write_text
from mmp_env.model.arm import LARGEST_M
from mmp_env.model.cell import Cell
from mmp_env.model.goals import goal_to_data
from mmp_env.model.keep import as_keep, keep_to_data
from mmp_env.model.margins import LEAST_MARGIN_M, Margins
from mmp_env.model.names import INSTANCE_NAMES, is_instance_name
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.model.problem import Problem, velocity_limits
from mmp_env.model.robot import frozen_array

PLAN_SCHEMA = "mmp-plan/1"


class MarginsData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    arms: float
    obstacles: float
    self_: float = msgspec.field(name="self")


class ProblemData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    cell: CellData
    start: dict[str, Any]
    goal: dict[str, Any]
    max_velocity: float | dict[str, Any]
    margin: float
    margins: MarginsData | None = None
    max_acceleration: float | dict[str, Any] | None = None
    max_jerk: float | dict[str, Any] | None = None
    name: str = ""
    goal_asked: dict[str, Any] | None = None
    keep: dict[str, Any] = {}


class PlanData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    problem: ProblemData
    times: list[Any]
    positions: dict[str, Any]
    velocities: dict[str, Any] | None = None
    accelerations: dict[str, Any] | None = None
    planner: dict[str, Any] = {}
    stats: dict[str, Any] = {}


_OTHER_LISTS = 1_000_000
"""Lists and objects of a plan file that are left for all but the rows of its arms."""
_ROWS = ("positions", "velocities", "accelerations")


def plan_to_dict(plan: Plan) -> dict[str, Any]:
    """Returns the plan in the form of `mmp-plan/1`, in dicts, lists and scalars.

    Raises `MmpError` if an arm is missing.
    """
    return plain(_content(plan))


def plan_to_check(plan: Plan) -> dict[str, Any]:
    """Returns the plan in the form of `mmp-plan/1` for the checker: long rows of finite numbers remain arrays.

    Lists of them take eight times the memory. Raises `MmpError` if an arm is missing or a part is of another kind.
    """
    _check_kinds(plan)
    out = _content(plan)
    rows = {key: out.pop(key) for key in _ROWS if key in out and all(np.isfinite(q).all() for q in out[key].values())}
    return plain(out) | rows


def _check_kinds(plan: Plan) -> None:
    """Raises `MmpError` for a plan without problem or times, or with statistics of another kind."""
    given("problem of a plan", plan.problem, Problem, "a Problem")
    given("times of a plan", plan.times, np.ndarray, "an array of times [s]")
    for name in ("planner", "stats"):
        given(f"{name} of a plan", getattr(plan, name), Mapping, "a mapping from name to value")


def _content(plan: Plan) -> dict[str, Any]:
    problem = plan.problem
    limits = {"max_acceleration": plan.max_acceleration, "max_jerk": plan.max_jerk}
    out = {
        "schema": PLAN_SCHEMA,
        "problem": {
            "name": problem.name,
            "cell": cell_to_dict(problem.cell),
            "start": _by_arm(problem.cell, problem.start),
            "goal": _by_arm(problem.cell, problem.goal),
            **({"goal_asked": _asked(problem)} if problem.goal_asked else {}),
            "max_velocity": _by_arm(problem.cell, problem.max_velocity),
            **{key: _by_arm(problem.cell, values) for key, values in limits.items() if values is not None},
            "margin": problem.margin,
            "margins": dict(problem.margins),
            **({"keep": keep_to_data(problem.keep)} if problem.keep else {}),
        },
        "times": plan.times,
        "positions": _by_arm(problem.cell, plan.positions),
    }
    for key, values in (("velocities", plan.velocities), ("accelerations", plan.accelerations)):
        if values is not None:
            out[key] = _by_arm(problem.cell, values)
    return out | {"planner": plan.planner, "stats": plan.stats}


def plan_from_dict(data: Any, where: str | Location = "plan") -> Plan:
    """Returns the plan in a file's `data`. The checker, not this function, tests that the plan is right.

    Args:
        data: content of a plan.json.
        where: begin of the messages, such as the name of the file.

    Raises:
        MmpError: for malformed data, with field and value.
    """
    place, decoded = decode_file(data, PLAN_SCHEMA, PlanData, where)
    for key in ("planner", "stats"):
        require_finite(getattr(decoded, key), str(place / key))
    problem = _problem(decoded.problem, place / "problem")
    if not decoded.times:
        raise MmpError(f"{place / 'times'} is empty; a plan needs at least one time")
    if decoded.accelerations is not None and decoded.velocities is None:
        raise MmpError(f"{place / 'velocities'} is missing; a plan with accelerations has velocities too")
    matrices = {
        key: _matrices(problem.cell, rows, len(decoded.times), place / key)
        for key in ("positions", "velocities", "accelerations")
        if (rows := getattr(decoded, key)) is not None
    }
    limits = {
        key: _by_joint(problem.cell, value, place / "problem" / key)
        for key in ("max_acceleration", "max_jerk")
        if (value := getattr(decoded.problem, key)) is not None
    }
    times = frozen_array(numbers(decoded.times, len(decoded.times), place / "times", "time"))
    return Plan(problem=problem, times=times, planner=decoded.planner, stats=decoded.stats, **matrices, **limits)


def save_plan(plan: Plan, path: str | PathLike[str]) -> None:
    """Writes a plan file, the whole file or nothing. The same plan gives the same bytes.

    Args:
        plan: a plan with finite numbers, and as many configurations of each arm as times.
        path: the file; a file that is there is replaced.

    Raises:
        MmpError: for None or another object, numbers that are not finite, rows of another size, a plan larger than
            512 MB, and a file that cannot be written.
    """
    given_plan(plan, "save")
    _check_kinds(plan)
    _check_rows(plan)
    # Before the text is made: that of a plan that is much too large takes more memory than there is.
    _check_size(plan, path)
    try:
        text = json_text(plan_to_dict(plan))
    except TypeError as error:
        raise MmpError(f"the plan cannot be saved: {error}") from None
    if len(text) > MAX_PLAN_BYTES:
        size, most = len(text) / 2**20, MAX_PLAN_BYTES / 2**20
        said = f"the plan takes {size:.0f} MB as a file; {most:.0f} MB is the most that is read"
        raise MmpError(f"{path}: {said}{_smaller(plan)}")
    write_text(path, text)


def _check_size(plan: Plan, path: str | PathLike[str]) -> None:
    """Raises `MmpError` for more configurations than are read, each of which is a list in the file."""
    kinds = [plan.positions, *(rows for rows in (plan.velocities, plan.accelerations) if rows is not None)]
    count, most = sum(len(rows) for kind in kinds for rows in kind.values()), MOST_PLAN_COLLECTIONS - _OTHER_LISTS
    if count > most:
        said = f"the plan has {count:,} configurations, velocities and accelerations; {most:,} is the most that is read"
        raise MmpError(f"{path}: {said}{_smaller(plan)}")


def _smaller(plan: Plan) -> str:
    """Returns the end of a sentence: what makes the file of a plan smaller."""
    return "; retime it with a lower rate (--rate), or not at all (--no-retime)" if plan.retimed else ""


def _check_rows(plan: Plan) -> None:
    """Raises `MmpError` for NaN and infinity, which JSON lacks, and for rows that are not one of each time."""
    arrays = {"times": plan.times}
    if plan.times.ndim != 1 or not len(plan.times):
        raise MmpError(f"the plan cannot be saved: times has shape {plan.times.shape}; it must be one row")
    if plan.accelerations is not None and plan.velocities is None:
        raise MmpError("the plan cannot be saved: it has accelerations and no velocities")
    for key in ("positions", "velocities", "accelerations"):
        by_arm: Mapping[str, np.ndarray] = getattr(plan, key) or {}
        for arm in plan.problem.cell.arms:
            name, wanted = arm.name, (len(plan.times), arm.dof)
            if name in by_arm and (shape := np.shape(by_arm[name])) != wanted:
                raise MmpError(
                    f"the plan cannot be saved: {key} of arm '{name}' has shape {shape}; it must be {wanted}"
                )
        arrays |= {f"{key} of arm '{name}'": rows for name, rows in by_arm.items()}
    for what, values in arrays.items():
        if np.asarray(values).dtype.kind not in "iuf":
            raise MmpError(f"the plan cannot be saved: its {what} are not numbers")
        if not np.isfinite(values).all():
            raise MmpError(f"the plan cannot be saved: its {what} hold a number that is not finite")


def load_plan(path: str | PathLike[str]) -> Plan:
    """Reads a plan file, schema `mmp-plan/1`. The plan may still be wrong; `check_plan` tests it.

    Args:
        path: a JSON file.

    Raises:
        MmpError: for a file that cannot be read, or malformed data, with file, field and value.
    """
    return plan_from_dict(read_for("load_plan", path, PLAN), str(path))


def _by_arm(cell: Cell, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns the values in the order of the cell's arms."""
    if values.keys() != set(cell.arm_names):
        has, wanted = (", ".join(names) or "none" for names in (values, cell.arm_names))
        raise MmpError(f"the plan has numbers for the arms {has}; a file needs them for {wanted}")
    return {name: values[name] for name in cell.arm_names}


def _asked(problem: Problem) -> dict[str, Any]:
    """Returns what was asked for of each arm, in the form of JSON."""
    return {name: goal_to_data(problem.goal_asked[name]) for name in problem.cell.arm_names}


def _problem(data: ProblemData, place: Location) -> Problem:
    cell, asked = cell_from_data(data.cell, place / "cell", name="cell"), data.goal_asked
    if data.keep:
        cell = replace(cell, keep=as_keep(data.keep, cell.arm_names, str(place / "keep")))
    return Problem(
        cell=cell,
        start=configurations_from_dict(cell, data.start, place / "start"),
        goal=configurations_from_dict(cell, data.goal, place / "goal"),
        max_velocity=velocity_limits(cell, _limits(cell, data.max_velocity, place / "max_velocity")),
        margins=_margins(data, place),
        name=_name(data.name, place / "name"),
        goal_asked={} if asked is None else goals_from_dict(cell, asked, place / "goal_asked"),
    )


def _name(name: str, place: Location) -> str:
    if not is_instance_name(name):
        raise place.wrong(name, INSTANCE_NAMES)
    return name


def _margins(data: ProblemData, place: Location) -> Margins:
    """Returns the margins; half of `margin` for older files without `margins`, whose plans were proved for that."""
    if data.margins is None:
        margin = _margin(data.margin, place / "margin", 2)
        return Margins(arms=margin / 2, obstacles=margin / 2, self=margin / 2)
    here, given = place / "margins", data.margins
    by_kind = {"arms": given.arms, "obstacles": given.obstacles, "self": given.self_}
    margin = _margin(data.margin, place / "margin")
    margins = Margins(**{kind: _margin(value, here / kind) for kind, value in by_kind.items()})
    if margin != margins.arms:
        raise (place / "margin").wrong(margin, f"margins.arms, which is {margins.arms:g}")
    return margins


def _margin(value: float, place: Location, times: int = 1) -> float:
    """Returns the margin [m]. Raises `MmpError` unless it is within the bounds of margins, each taken `times`."""
    least, most = times * LEAST_MARGIN_M, times * LARGEST_M
    if not least <= value <= most:
        raise place.wrong(value, f"a positive number [m], {least:g} at least and {most:g} at most")
    return value


def _limits(cell: Cell, data: Any, place: Location) -> float | dict[str, Float[np.ndarray, "dof"]]:
    """Returns a positive number for all joints, or one for each joint of each arm."""
    if not isinstance(data, dict):
        if not (math.isfinite(data) and data > 0):
            raise place.wrong(data, "a positive number")
        return data
    by_arm = configurations_from_dict(cell, data, place)
    for name, values in by_arm.items():
        if not (values > 0).all():
            raise (place / name / int(np.argmin(values))).wrong(float(values.min()), "a positive number")
    return by_arm


def _by_joint(cell: Cell, data: Any, place: Location) -> dict[str, Float[np.ndarray, "dof"]]:
    """Returns `_limits` with a number for each joint."""
    limits = _limits(cell, data, place)
    if isinstance(limits, dict):
        return {name: frozen_array(values) for name, values in limits.items()}
    return {arm.name: frozen_array(np.full(arm.dof, limits)) for arm in cell.arms}


def _matrices(cell: Cell, data: Any, count: int, place: Location) -> dict[str, Float[np.ndarray, "t dof"]]:
    """Returns arm name -> a row of joints for each of `count` times."""
    check_arms(cell, data, place)
    out = {}
    for arm in cell.arms:
        rows, here = data[arm.name], place / arm.name
        if not isinstance(rows, list):
            raise here.wrong(rows, "a list of configurations")
        if len(rows) != count:
            raise MmpError(f"{here} has {len(rows)} configurations; it must have {count}, one for each of the times")
        matrix = _at_once(rows, arm.dof)
        if matrix is None:
            of = f"joint of a {arm.robot.name}"
            matrix = np.array([numbers(row, arm.dof, here / k, of) for k, row in enumerate(rows)])
        out[arm.name] = frozen_array(matrix)
    return out


def _at_once(rows: list[Any], dof: int) -> Float[np.ndarray, "t dof"] | None:
    """Returns the rows as a matrix, or None if any is not `dof` finite numbers.

    Fast, for the many rows of retimed plans.
    """
    if not all(type(row) is list and len(row) == dof for row in rows):
        return None
    if not {type(value) for row in rows for value in row} <= {int, float}:
        return None
    try:
        matrix = np.array(rows, dtype=float)
    except OverflowError:
        return None
    return matrix if np.isfinite(matrix).all() else None
