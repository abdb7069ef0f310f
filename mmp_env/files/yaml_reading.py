"""YAML of plain values, by the core schema of YAML 1.2: null, true and false, numbers, text, lists and objects.

The parser's events become values here. PyYAML's own loader follows YAML 1.1, where `off` is false, `1:30` is 90 and
`1e-3` is text; and what a tag asks for may raise anything.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mmp_env.errors import MmpError

_MOST_LEVELS = 50
_LONGEST_INTEGER = 18
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
    """A list or an object whose end is yet to come; `key` is the field that waits for its value."""

    is_object: bool
    items: list[Any] = field(default_factory=list)
    pairs: Pairs = field(default_factory=list)
    key: str | None = None


def yaml_value(text: str | bytes, as_object: Callable[[Pairs], dict[str, Any]]) -> Any:
    """Returns the value of the one document in `text`, None where there is none; `as_object` makes an object of pairs.

    Raises `MmpError` that names the line, for aliases, which can make a small file enormous, and for tags as well.
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
    # The scanner that is written in Python asks chr() and int() for what no character and no number is.
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
    """Puts a value where it belongs: among the items, as the next field, or as the value of that field."""
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
    """What a word without quotes means. As in JSON, whole numbers that are very long become floats."""
    if text in _WORDS:
        return _WORDS[text]
    if _WHOLE.fullmatch(text):
        base = {"0o": 8, "0x": 16}.get(text[:2], 10)
        if len(text) <= _LONGEST_INTEGER:
            return int(text, base)
        return float(text) if base == 10 else float("inf")
    return float(text) if _NUMBER.fullmatch(text) else text


def _one_line(text: object) -> str:
    return " ".join(str(text).split())
