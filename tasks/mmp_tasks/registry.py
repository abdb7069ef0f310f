"""Tasks by name: the entry points of the group `mmp_env.tasks`, loaded on first use."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.task import Task
from mmp_env.plugins import TASKS

_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


@dataclass(frozen=True, kw_only=True)
class TaskDescription:
    """A task in `mmp list`: the first line of its docstring as `summary`, and its options with their defaults."""

    name: str
    summary: str
    options: dict[str, Any]


def names() -> list[str]:
    """Returns the names of all registered tasks, sorted."""
    return TASKS.names()


def make(name: str, **options: Any) -> Task:
    """Returns the task of that name.

    Args:
        name: a registered task.
        **options: fields of the task, such as `clearance=0.02`; `describe` lists them.

    Raises:
        UnknownNameError: for an unknown task or option.
        MmpError: for a task that does not load, or a value that the task refuses.
    """
    kind = TASKS.load(name)
    known = _fields(kind)
    for option, value in options.items():
        if option not in known:
            raise UnknownNameError(f"option of task '{name}'", option, known)
        _check_kind(name, option, value, known[option].default)
    task = kind(**options)
    if not isinstance(task, Task):
        raise MmpError(f"task '{name}' has no method sample(cell, rng)")
    return task


def describe(name: str) -> TaskDescription:
    """Returns the summary and the options of a task. Raises like `make`."""
    kind = TASKS.load(name)
    summary = (kind.__doc__ or "").strip().partition("\n")[0]
    defaults = {
        option: field.default if field.default is not dataclasses.MISSING else None
        for option, field in _fields(kind).items()
    }
    return TaskDescription(name=name, summary=summary, options=defaults)


def _check_kind(name: str, option: str, value: object, default: object) -> None:
    """Raises `MmpError` if the value has another type than the default. A whole number is also a number."""
    kind = type(default)
    if kind in _KINDS and type(value) is not kind and not (kind is float and type(value) is int):
        raise MmpError(f"{option} of task '{name}' is {value!r}; it must be {_KINDS[kind]}")


def _fields(kind: Any) -> dict[str, dataclasses.Field[Any]]:
    return {field.name: field for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else {}
