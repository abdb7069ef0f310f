"""Checks of arguments. A fault becomes one sentence with the name, the value and the allowed values."""

from __future__ import annotations

import functools
import inspect
import math
import os
import sys
from collections.abc import Callable
from numbers import Real
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mmp_env.errors import MmpError, UnknownArgumentError
from mmp_env.wording import shown

P = ParamSpec("P")
T = TypeVar("T")


def given(name: str, value: object, kind: type[T], allowed: str) -> T:
    """Returns the value. Raises `MmpError` if it is not of this kind."""
    if isinstance(value, kind):
        return value
    raise refused(name, value, allowed)


def flag(name: str, value: object) -> bool:
    """Returns the value as a bool. Raises `MmpError` for anything but True and False of Python or NumPy."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise refused(name, value, "True or False")


def text(name: str, value: object) -> str:
    """Returns the value. Raises `MmpError` if it is not text."""
    return given(name, value, str, "text")


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Returns the value as an int. Raises `MmpError` unless it is a whole number of Python or NumPy within bounds."""
    bounds = f"{least} or more" if most is None else f"{least} or more, and {most} at most"
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        out = int(value)
        if least <= out and (most is None or out <= most):
            return out
    raise refused(name, value, f"a whole number, {bounds}")


def number(name: str, value: object, allowed: str, *, zero: bool = False, infinite: bool = False) -> float:
    """Returns the value as a float. Raises `MmpError`, with the `allowed` values, unless it is a number above 0.

    `zero` allows 0, and `infinite` infinity.
    """
    try:
        out = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        out = math.nan
    if (out > 0 or (zero and out == 0)) and (infinite or out < math.inf):
        return out
    raise refused(name, value, allowed)


def path(name: str, value: object) -> str | os.PathLike[str]:
    """Returns the value. Raises `MmpError` unless it is text or a path of text."""
    if isinstance(value, str) or (isinstance(value, os.PathLike) and isinstance(os.fspath(value), str)):
        return value
    raise refused(name, value, "the path of a file")


def known_keywords(function: Callable[P, T]) -> Callable[P, T]:
    """Makes a function raise `UnknownArgumentError`, with the nearest name, for a keyword that it does not have."""
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = inspect.signature(function).parameters.values()
    known = [each.name for each in parameters if each.kind in named and each.name != "self"]

    @functools.wraps(function)
    def checked(*args: P.args, **keywords: P.kwargs) -> T:
        for name in keywords.keys() - known:
            raise UnknownArgumentError(f"argument of {function.__name__}()", name, known)
        return function(*args, **keywords)

    return checked


def require_finite(value: object, where: str) -> None:
    """Raises `MmpError` if a number in a JSON value is NaN or beyond all floats; `where` names the value."""
    if isinstance(value, dict):
        for key, item in value.items():
            word = key if key.isprintable() else shown(key)
            require_finite(item, f"{where}{word}" if where.endswith(" ") else f"{where}.{word}")
    elif isinstance(value, list):
        for k, item in enumerate(value):
            require_finite(item, f"{where}[{k}]")
    elif isinstance(value, int | float) and not abs(value) <= sys.float_info.max:
        raise refused(where, value, "a finite number")


def as_numbers(value: Any) -> np.ndarray | None:
    """Returns the value as an array of floats.

    Returns None for text, truth values, masked numbers, and numbers beyond all floats.
    """
    if _has_truth_value(value) or _has_masked_number(value):  # NumPy takes these for numbers
        return None
    try:
        array = np.asarray(value)
        return np.asarray(array, dtype=float) if array.dtype.kind in "fiuO" else None
    except (TypeError, ValueError, OverflowError):
        return None


def _has_truth_value(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "bO" and any(map(_has_truth_value, value.flat))
    if isinstance(value, list | tuple):
        return any(map(_has_truth_value, value))
    return isinstance(value, bool | np.bool_)


def _has_masked_number(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return any(map(_has_masked_number, value))
    if type(value) is np.ndarray or not isinstance(value, np.ndarray):
        return False
    return bool(np.ma.is_masked(value))  # imports numpy.ma, so only for subclasses of arrays


def refused(name: str, value: object, allowed: str) -> MmpError:
    """Returns the error that a value is not allowed; `allowed` says what is."""
    said = "None" if value is None else repr(value) if isinstance(value, bool) else " ".join(shown(value).split())
    return MmpError(f"{name} is {said}; it must be {allowed}")
