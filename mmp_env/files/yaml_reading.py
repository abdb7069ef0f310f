"""Reads YAML by the core schema of YAML 1.2: null, true and false, numbers, text, lists and objects.

This module builds values from the parser's events. PyYAML's own loader follows YAML 1.1, where `off` is false, `1:30`
is 90 and `1e-3` is text, and its tags may raise any exception.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mmp_env.errors import MmpError

_MOST_LEVELS = 50
"""Deepest nesting that is read."""
LONGEST_INTEGER = 19
"""Largest number of digits of a whole number; a longer one becomes a float."""
_TAGS = "tag:yaml.org,2002:"
_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
    **{f"{sign}{word}": float(f"{sign}inf") for sign in ("", "+", "-") for word in (".inf", ".Inf", ".INF")},
}
_WHOLE = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", re.ASCII)
_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)

Pairs = list[tuple[str, Any]]


@dataclass(kw_only=True)
class _Collection:
    """An unfinished list or object; `key` is the field without a value so far."""

    is_object: bool
    items: list[Any] = field(default_factory=list)
    pairs: Pairs = field(default_factory=list)
    key: str | None = None


def yaml_value(text: str | bytes, as_object: Callable[[Pairs], dict[str, Any]]) -> Any:
    """Returns the value of the only document in `text`, None for no document; `as_object` makes an object of pairs.

    Raises `MmpError` with the line for faults, for tags, and for aliases, which can make a small file enormous.
    """
    import yaml

    try:
        return _value(yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)), as_object)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise MmpError(f"not YAML: {_one_line(error.problem or error.context)}{where}") from None
    except MmpError:
        raise
    # The scanner in Python calls chr() and int() with bad values.
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise MmpError(f"not YAML: {_one_line(error)}") from None


def _value(events: Any, as_object: Callable[[Pairs], dict[str, Any]]) -> Any:
    import yaml

    document = _Collection(is_object=False)
    stack = [document]
    documents = 0
    for event in events:
        line = event.start_mark.line + 1
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise MmpError(f"not YAML: expected a single document, but found another document at line {line}")
        elif isinstance(event, yaml.AliasEvent):
            raise MmpError(f"line {line}: YAML aliases (*name) are not supported; write the value out")
        elif isinstance(event, yaml.CollectionEndEvent):
            done = stack.pop()
            _add(stack[-1], as_object(done.pairs) if done.is_object else done.items, line)
        elif isinstance(event, yaml.NodeEvent):
            _refuse_tag(event, line)
            if isinstance(event, yaml.ScalarEvent):
                _add(stack[-1], _scalar(event.value) if event.implicit[0] else event.value, line)
                continue
            if len(stack) > _MOST_LEVELS:
                raise MmpError("it is nested too deeply; the files of mmp-env need no more than ten levels")
            if stack[-1].is_object and stack[-1].key is None:
                raise MmpError(f"line {line}: the field name must be text, not a list or an object")
            stack.append(_Collection(is_object=isinstance(event, yaml.MappingStartEvent)))
    return document.items[0] if document.items else None


def _add(collection: _Collection, value: Any, line: int) -> None:
    """Adds a value to a collection: as an item, as the next field, or as the value of that field."""
    if not collection.is_object:
        collection.items.append(value)
    elif collection.key is not None:
        collection.pairs.append((collection.key, value))
        collection.key = None
    elif isinstance(value, str):
        collection.key = value
    else:
        raise MmpError(f"line {line}: the field name {json.dumps(value)} must be text; put it in quotes")


def _refuse_tag(event: Any, line: int) -> None:
    tag = getattr(event, "tag", None)
    if tag is not None:
        word = "!!" + tag.removeprefix(_TAGS) if tag.startswith(_TAGS) else tag
        raise MmpError(f"line {line}: the YAML tag '{word}' is not supported; leave it out")


def _scalar(text: str) -> Any:
    """Returns the value of a word without quotes. As in JSON, very long whole numbers become floats."""
    if text in _WORDS:
        return _WORDS[text]
    if _WHOLE.fullmatch(text):
        base = {"0o": 8, "0x": 16}.get(text[:2], 10)
        if len(text) <= LONGEST_INTEGER:
            return int(text, base)
        return float(text) if base == 10 else float("inf")
    return float(text) if _NUMBER.fullmatch(text) else text


def _one_line(text: object) -> str:
    return " ".join(str(text).split())
