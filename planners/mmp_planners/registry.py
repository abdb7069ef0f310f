"""Planners by name: the entry points of the group `mmp_env.planners`, loaded on first use."""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import sys
import typing
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, UnknownNameError, in_words
from mmp_env.events import ignore
from mmp_env.plugins import PLANNERS
from mmp_env.wording import shown
from mmp_planners.planner import About, Planner

PRESET = "preset"
"""Option of planners that have presets."""
OURS = "ours"
"""Preset of the defaults."""

_TYPES = {
    "bool": (bool, "true or false"),
    "int": (int, "an integer"),
    "float": (float, "a number"),
    "str": (str, "text"),
}
"""Type of an option as written -> its Python type, and its name in messages."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Option:
    """An option of a planner: name, type as written, default and documentation."""

    name: str
    type: str
    default: Any
    doc: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Description:
    """A planner's name, the first sentence of its docstring, its options, and its `About` if it has one."""

    name: str
    summary: str
    options: tuple[Option, ...]
    about: About | None = None


def names() -> list[str]:
    """Returns the names of all installed planners, sorted, without importing them."""
    return PLANNERS.names()


def is_foreign(name: str) -> bool:
    """Returns whether a planner comes from another package, without importing it.

    Raises:
        UnknownNameError: if there is no planner of that name.
    """
    return PLANNERS.is_foreign(name)


def load(name: str) -> type:
    """Returns a planner's class.

    Raises:
        UnknownNameError: if there is no planner of that name.
        MmpError: if the planner does not load or has no method `plan` as every planner has.
    """
    found = PLANNERS.load(name)
    fault = signature_fault(found)
    if fault:
        raise MmpError(f"{PLANNERS.whose(name)} {fault}")
    return found


def signature_fault(found: Any) -> str | None:
    """Returns what is wrong with a planner's class or its method `plan`, or None."""
    if not isinstance(found, type):
        return f"is no class but a {type(found).__name__}"
    method = getattr(found, "plan", None)
    if not callable(method):
        return "has no method plan(problem, *, seed, time_limit, watch)"
    signature = inspect.signature(method)
    try:
        signature.bind(None, None)
        signature.bind(None, None, seed=0, time_limit=1.0, watch=ignore)
    except TypeError as error:
        return f"has plan{signature}, not plan(self, problem, *, seed=0, time_limit=inf, watch=ignore): {error}"
    return None


def make(name: str, **options: Any) -> Planner:
    """Returns a planner.

    Args:
        name: name of the planner, one of `names()`.
        options: values of its options; `describe(name)` lists them.

    Raises:
        UnknownNameError: if there is no planner of that name.
        MmpError: if an option does not exist, its value is not allowed, or the planner does not load.
    """
    planner = load(name)
    options = _with_preset(name, planner, options)
    known = {option.name: option for option in _description(name, planner).options}
    for key, value in options.items():
        if key not in known:
            close = difflib.get_close_matches(key, known, n=1, cutoff=0.4)
            hint = f" Did you mean '{close[0]}'?" if close else ""
            raise MmpError(f"planner '{name}' has no option '{key}'.{hint} Known: {', '.join(sorted(known)) or 'none'}")
        options[key] = _converted(name, known[key], value)
    try:
        return planner(**options)
    except (MmpError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise MmpError(f"planner '{name}' cannot be made: {in_words(error)}") from error


def _with_preset(name: str, planner: type, options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options of the preset that is asked for, if any, under those that are given."""
    presets = getattr(planner, "presets", {})
    given = dict(options)
    if not presets or PRESET not in given:
        return given
    asked = given.pop(PRESET)
    if asked == OURS:
        return given
    if not isinstance(asked, str) or asked not in presets:
        raise UnknownNameError(f"value of option '{PRESET}' of planner '{name}'", asked, [OURS, *presets])
    return {**presets[asked], **given}


def describe(name: str) -> Description:
    """Returns name, summary, options and paper of a planner.

    Raises:
        UnknownNameError: if there is no planner of that name.
        MmpError: if the planner does not load.
    """
    return _description(name, load(name))


def _description(name: str, planner: type) -> Description:
    summary = (inspect.getdoc(planner) or "").split("\n\n")[0].replace("\n", " ")
    about = getattr(planner, "about", None)
    try:
        options = tuple(_options(planner))
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise MmpError(f"planner '{name}' does not say its options: {in_words(error)}") from error
    return Description(name=name, summary=summary, options=options, about=about if isinstance(about, About) else None)


def _options(planner: type) -> Iterator[Option]:
    presets = getattr(planner, "presets", {})
    if presets:
        doc = f"values of all options that are not given: {OURS}: the defaults; {', '.join(presets)}: its values"
        yield Option(name=PRESET, type="str", default=OURS, doc=doc)
    try:
        hints = typing.get_type_hints(planner)
    except Exception:  # the types are imported for type checkers only
        hints = {}
    for f in dataclasses.fields(planner) if dataclasses.is_dataclass(planner) else ():
        if f.init:
            kind = getattr(hints.get(f.name), "__name__", str(f.type))
            yield Option(name=f.name, type=kind, default=_default(f), doc=f.metadata.get("doc", ""))


def _default(f: dataclasses.Field) -> Any:
    if f.default_factory is not dataclasses.MISSING:
        return f.default_factory()
    return None if f.default is dataclasses.MISSING else f.default


def _converted(planner: str, option: Option, value: Any) -> Any:
    """Returns the value in the option's type: NumPy scalars and integers serve as floats, `on` and `off` as bools."""
    if isinstance(value, np.generic):
        value = value.item()
    wanted, words = _TYPES.get(option.type, (None, ""))
    if wanted is bool and value in ("on", "off"):
        return value == "on"
    if wanted is None or type(value) is wanted:
        return value
    if wanted is float and type(value) is int:
        if abs(value) <= sys.float_info.max:
            return float(value)
        words = f"a number up to {sys.float_info.max:.3g}"
    raise MmpError(f"option '{option.name}' of planner '{planner}' is {shown(value)}; it takes {words}")
