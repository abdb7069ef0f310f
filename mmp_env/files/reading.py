"""Reading JSON and YAML that other people wrote: every fault becomes one sentence with file, field and value.

Two layers: `read_document` turns a file into plain dicts and lists (malformed, binary, deep, huge, twice-named fields),
`decode` turns those into a msgspec `Struct` (missing, unknown and mistyped fields). What the values mean is checked by
the module that asked.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar, get_args

import msgspec

from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.files.regular_files import check_size, read_bytes
from mmp_env.wording import shown

T = TypeVar("T", bound=msgspec.Struct)

_YAML_SUFFIXES = (".yaml", ".yml")
MAX_JSON_BYTES = 64 * 2**20
MAX_YAML_BYTES = 2**18
"""YAML is for cells written by hand; its reader is a thousand times slower than that of JSON."""

_PLAIN_WORDS = {
    "str": "text",
    "int": "a whole number",
    "float": "a number",
    "bool": "true or false",
    "array": "a list",
    "object": "an object",
    "null": "null",
}
_LONGEST_INTEGER = 18
MOST_COLLECTIONS = 2_000_000
"""Most lists and objects that are read of one JSON text. A plan of 64 MB has about half a million; empty lists take 30
times the memory of their text.
"""


class NotJsonError(MmpError):
    """Text that is not JSON."""


@dataclass(frozen=True)
class Location:
    """Where a value stands, for messages: `cell.yaml: arms[2].yaw`."""

    file: str
    field: str = ""

    def __truediv__(self, key: str | int) -> Location:
        step = f"[{key}]" if isinstance(key, int) else f".{key}" if self.field else key
        return Location(self.file, self.field + step)

    def __str__(self) -> str:
        return f"{self.file}: {self.field}" if self.field else self.file

    def wrong(self, value: object, allowed: str) -> MmpError:
        """The error that the value here is not what is `allowed`."""
        return MmpError(f"{self} is {shown(value)}; it must be {allowed}")


@contextmanager
def named(place: Location | str) -> Iterator[None]:
    """Puts the place in front of the message of every `MmpError` from inside."""
    try:
        yield
    except InvalidInstanceError as error:
        raise InvalidInstanceError(f"{place}: {error}") from None
    except MmpError as error:
        raise MmpError(f"{place}: {error}") from None


def names_file(text: str) -> bool:
    """Whether a text is meant as a JSON or YAML file, there or not, rather than as the name of something."""
    return "/" in text or Path(text).suffix.lower() in (".json", *_YAML_SUFFIXES)


def read_document(path: str | PathLike[str]) -> Any:
    """The content of a JSON or (`.yaml`, `.yml`) YAML file as dicts, lists and scalars. Raises `MmpError`.

    A name without a suffix, as pipes have, says nothing: there, text is YAML unless it begins like an object or a list
    of JSON.
    """
    suffix = Path(path).suffix.lower()
    is_yaml = suffix in _YAML_SUFFIXES
    limit = MAX_YAML_BYTES if is_yaml else MAX_JSON_BYTES
    place = Location(str(path))
    content = read_bytes(path, limit, "YAML" if is_yaml else "JSON")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MmpError(
            f"{place} is not text in UTF-8 (byte {error.object[error.start]:#04x} at {error.start}); "
            "it must be a JSON or YAML file"
        ) from None
    if not suffix and not text.lstrip().startswith(("{", "[")):
        check_size(path, content, MAX_YAML_BYTES, "YAML")
        is_yaml = True
    return parse_yaml(text, place) if is_yaml else parse_json(text, place)


def parse_json(text: str, place: Location) -> Any:
    """JSON, with NaN and infinities let through so that the field that holds them can be named.

    Raises `MmpError`, namely `NotJsonError` for text that is none.
    """

    def whole(digits: str) -> int | float:
        return int(digits) if len(digits) <= _LONGEST_INTEGER else float(digits)

    if text.count("[") + text.count("{") > MOST_COLLECTIONS:
        raise MmpError(f"{place} has more than {MOST_COLLECTIONS:,} lists and objects, the most that are read")
    try:
        with named(place):
            return json.loads(text, object_pairs_hook=unique, parse_int=whole)
    except json.JSONDecodeError as error:
        raise NotJsonError(f"{place} is not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    except RecursionError:
        raise MmpError(f"{place} is nested too deeply; the files of mmp-env need no more than ten levels") from None


def parse_yaml(text: str, place: Location) -> Any:
    """The value of a YAML document, see `yaml_value`. Raises `MmpError`."""
    from mmp_env.files.yaml_reading import yaml_value

    with named(place):
        return yaml_value(text, unique)


def check_schema(data: Any, wanted: str, place: Location) -> None:
    """Raises `MmpError` unless `data` is an object whose `schema` is `wanted`."""
    if not isinstance(data, dict):
        raise place.wrong(data, f"an object of schema '{wanted}'")
    if "schema" not in data:
        raise MmpError(f"{place / 'schema'} is missing; it must be '{wanted}'")
    if data["schema"] != wanted:
        raise (place / "schema").wrong(data["schema"], f"'{wanted}'")


def numbers(value: Any, count: int, place: Location, of: str) -> list[float]:
    """`value`, a list of `count` finite numbers; `of` says in messages what has that many. Raises `MmpError`."""
    if not isinstance(value, list):
        raise place.wrong(value, f"a list of {count} numbers")
    for k, number in enumerate(value):
        is_number = isinstance(number, int | float) and not isinstance(number, bool)
        if not (is_number and abs(number) <= sys.float_info.max):
            raise (place / k).wrong(number, "a finite number")
    if len(value) != count:
        raise MmpError(f"{place} has {len(value)} numbers; it must have {count}, one for each {of}")
    return value


def decode(data: Any, kind: type[T], place: Location) -> T:
    """`data` as a `kind`, a msgspec `Struct`. Raises `MmpError` that names the field; for a typo, the nearest one."""
    try:
        return msgspec.convert(data, kind)
    except UnicodeEncodeError as error:
        lone = error.object[error.start]
        raise MmpError(f"{place} holds text with {lone!r}, half of a pair of escapes and no character") from None
    except OverflowError:
        where, number = next(_beyond_floats(data, place))
        raise where.wrong(number, "a finite number") from None
    except msgspec.ValidationError as error:
        message, _, path = str(error).partition(" - at `$")
    value, owner = data, kind
    for name, index in re.findall(r"\.(\w+)|\[(\d+)\]", path.rstrip("`")):
        key = name or int(index)
        place, value, owner = place / key, value[key], _inside(owner, name) if name else owner
    if unknown := re.match(r"Object contains unknown field `(.*)`", message, re.DOTALL):
        known = [f.encode_name for f in msgspec.structs.fields(owner)]
        raise MmpError(f"{place}: {UnknownNameError('field', shown(unknown[1])[1:-1], known)}")
    if missing := re.match(r"Object missing required field `(.*)`", message):
        raise MmpError(f"{place / missing[1]} is missing")
    allowed = re.match(r"Expected (.*?)(, got .*)?$", message)
    words = re.sub(r"`([^`]*)`", lambda found: _in_words(found[1]), allowed[1]) if allowed else "a number in range"
    raise place.wrong(value, words)


def _beyond_floats(data: Any, place: Location) -> Iterator[tuple[Location, int]]:
    """The whole numbers that no float can hold, with their places. Only data that Python code made has any."""
    if isinstance(data, int) and abs(data) > sys.float_info.max:
        yield place, data
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list | tuple) else ()
    for key, item in items:
        yield from _beyond_floats(item, place / key)


def _in_words(types: str) -> str:
    return " or ".join(_PLAIN_WORDS.get(name, name) for name in types.split(" | "))


def _inside(owner: Any, field: str) -> Any:
    """The `Struct` that a field of a `Struct` holds, alone, in a list or in a union; its type where it holds none."""
    inner = {f.encode_name: f.type for f in msgspec.structs.fields(owner)}[field]
    return next((part for part in get_args(inner) if hasattr(part, "__struct_fields__")), inner)


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of these fields. Raises `MmpError` for one that is there twice."""
    out = dict(pairs)
    if len(out) < len(pairs):
        [(twice, _)] = Counter(name for name, _ in pairs).most_common(1)
        raise MmpError(f"it has the field {shown(twice)} twice in one object; names must differ")
    return out
