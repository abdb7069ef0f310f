"""Planners by name: the entry points of the group `mmp_env.planners`, loaded when they are asked for."""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import typing
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from mmp_env.errors import MmpError, UnknownNameError
from mmp_planners.planner import Planner

GROUP = "mmp_env.planners"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Option:
    """A field of a planner: its name, type as written, default, and what it means."""

    name: str
    type: str
    default: Any
    doc: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Description:
    """A planner's name, the first sentence of its docstring, and its options."""

    name: str
    summary: str
    options: tuple[Option, ...]


def names() -> list[str]:
    """Names of all installed planners, sorted; nothing is imported for it."""
    return sorted({point.name for point in entry_points(group=GROUP)})


def load(name: str) -> type:
    """The planner's class. Raises `UnknownNameError`, or `MmpError` where its package does not import."""
    points: dict[str, EntryPoint] = {point.name: point for point in entry_points(group=GROUP)}
    if name not in points:
        raise UnknownNameError("planner", name, points)
    try:
        found = points[name].load()
    except Exception as error:
        raise MmpError(
            f"planner '{name}' ({points[name].value}) does not load: {type(error).__name__}: {error}"
        ) from error
    if not callable(getattr(found, "plan", None)):
        raise MmpError(
            f"planner '{name}' ({points[name].value}) has no method plan(problem, *, seed, time_limit, watch)"
        )
    return found


def make(name: str, **options: Any) -> Planner:
    """A planner with options. Raises `MmpError` for an option that does not exist, or a value that is not allowed."""
    planner = load(name)
    known = {option.name: option for option in describe(name).options}
    for key, value in options.items():
        if key not in known:
            close = difflib.get_close_matches(key, known, n=1, cutoff=0.4)
            hint = f" Did you mean '{close[0]}'?" if close else ""
            raise MmpError(f"planner '{name}' has no option '{key}'.{hint} Known: {', '.join(sorted(known)) or 'none'}")
        options[key] = _converted(name, known[key], value)
    return planner(**options)


def describe(name: str) -> Description:
    """What `mmp list` shows of a planner."""
    planner = load(name)
    summary = (inspect.getdoc(planner) or "").split("\n\n")[0].replace("\n", " ")
    fields = dataclasses.fields(planner) if dataclasses.is_dataclass(planner) else ()
    try:
        hints = typing.get_type_hints(planner)
    except NameError:  # of types imported for type checkers only
        hints = {}
    options = tuple(
        Option(
            name=f.name,
            type=getattr(hints.get(f.name), "__name__", str(f.type)),
            default=_default(f),
            doc=f.metadata.get("doc", ""),
        )
        for f in fields
        if f.init
    )
    return Description(name=name, summary=summary, options=options)


def _default(f: dataclasses.Field) -> Any:
    if f.default_factory is not dataclasses.MISSING:
        return f.default_factory()
    return None if f.default is dataclasses.MISSING else f.default


def _converted(planner: str, option: Option, value: Any) -> Any:
    """The value as the option's type: whole numbers serve as floats, on and off as bools, nothing else is bent."""
    wanted = {"bool": bool, "int": int, "float": float, "str": str}.get(option.type)
    if wanted is bool and value in ("on", "off"):
        return value == "on"
    if wanted is None or type(value) is wanted:
        return value
    if wanted is float and type(value) is int:
        return float(value)
    raise MmpError(f"option '{option.name}' of planner '{planner}' is {value!r}; it takes a {option.type}")
