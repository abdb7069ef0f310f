"""Kinds of values in a document: a number within bounds, a vector, a name. The program shares no code with it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

LONGEST_NAME = 100


def items(value: Any) -> list[Any]:
    """Returns the values of an object or a list; nothing of a scalar."""
    return list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []


def objects(value: Any) -> list[dict[str, Any]]:
    """Returns the objects in a list. Other items are judged where the list is."""
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


def leaves(value: Any) -> list[Any]:
    """Returns all scalars below a value."""
    if isinstance(value, dict | list):
        return [leaf for item in items(value) for leaf in leaves(item)]
    return [] if value is None else [value]


def numbers_of(value: Any) -> list[float]:
    """Returns all numbers of a document. Raises `ValueError` for one that is not finite."""
    if isinstance(value, bool):
        return []
    if isinstance(value, int | float):
        if not abs(value) < math.inf or abs(value) > 1e308:
            raise ValueError("a number that is not finite")
        return [float(value)]
    return [number for item in items(value) for number in numbers_of(item)]


def is_number(value: Any, least: float = -math.inf, most: float = math.inf) -> bool:
    """Returns whether a value is a finite number within bounds."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) < 1e308 and least <= value <= most


def is_positive(value: Any) -> bool:
    """Returns whether a value is a finite number above 0."""
    return is_number(value) and value > 0


def is_whole(value: Any, least: int) -> bool:
    """Returns whether a value is an integer that is large enough."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def is_vector(value: Any, length: int | None, least: float = -math.inf, most: float = math.inf) -> bool:
    """Returns whether a value is a list of numbers within bounds. Without a `length`, any length will do."""
    is_list = isinstance(value, list) and length in (None, len(value))
    return is_list and all(is_number(item, least, most) for item in value)


def is_direction(value: Any) -> bool:
    """Returns whether a value is a vector in space that is not zero."""
    return is_vector(value, 3) and any(value)


def is_name(value: Any) -> bool:
    """Returns whether a value may be the name of a cell, arm, obstacle or instance."""
    is_text = isinstance(value, str) and 1 <= len(value) <= LONGEST_NAME
    return is_text and value.isprintable() and "/" not in value


def missing(value: dict[str, Any], *keys: str) -> Iterator[str]:
    """Yields a sentence for each key that an object lacks."""
    yield from (f"no {key}" for key in keys if key not in value)


def wrong(value: dict[str, Any], key: str, is_right: bool) -> Iterator[str]:
    """Yields a sentence if the value of a key that is there, and not null, is not right."""
    if value.get(key) is not None and not is_right:
        yield f"{key} {str(value[key])[:60]}"
