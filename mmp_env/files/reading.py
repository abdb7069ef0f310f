"""Reads JSON and YAML files. Every fault becomes one sentence with file, field and value.

`read_document` turns a file into plain dicts and lists, and refuses malformed, binary, deep and huge files and repeated
fields. `decode` turns these into a msgspec `Struct`, and refuses missing, unknown and mistyped fields. The calling
module checks the meaning of the values.
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
from typing import Any, TypeVar, get_args, get_origin

import msgspec

from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.files.regular_files import check_size, read_bytes
from mmp_env.files.yaml_reading import LONGEST_INTEGER, yaml_value
from mmp_env.wording import shown

T = TypeVar("T", bound=msgspec.Struct)

_YAML_SUFFIXES = (".yaml", ".yml")
MAX_JSON_BYTES, MAX_YAML_BYTES = 64 * 2**20, 2**18
"""Largest files that are read. YAML is for cells written by hand; its reader is a thousand times slower."""

_PLAIN_WORDS = {
    "str": "text",
    "int": "a whole number",
    "float": "a number",
    "bool": "true or false",
    "array": "a list",
    "object": "an object",
    "null": "null",
}
MOST_COLLECTIONS = 2_000_000
"""Most lists and objects that are read of one JSON text; empty lists take 30 times the memory of their text."""
MAX_PLAN_BYTES, MOST_PLAN_COLLECTIONS = 8 * MAX_JSON_BYTES, 8 * MOST_COLLECTIONS
"""The same for plans: retimed plans of hundreds of arms have hundreds of samples of each arm in every second."""
_PLAN = re.compile(rb'(?:\xef\xbb\xbf)?\s*\{\s*"schema"\s*:\s*"mmp-plan/')
"""Beginning of a plan file, which may have a byte order mark."""


class NotJsonError(MmpError):
    """A text is not JSON."""


@dataclass(frozen=True)
class Location:
    """Place of a value in a file, for messages: `cell.yaml: arms[2].yaw`."""

    file: str
    field: str = ""

    def __truediv__(self, key: str | int) -> Location:
        step = f"[{key}]" if isinstance(key, int) else f".{key}" if self.field else key
        return Location(self.file, self.field + step)

    def __str__(self) -> str:
        return f"{self.file}: {self.field}" if self.field else self.file

    def wrong(self, value: object, allowed: str) -> MmpError:
        """Returns the error that the value here is not allowed; `allowed` says what is."""
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
    """Returns whether a text looks like the path of a JSON or YAML file rather than a name."""
    return "/" in text or Path(text).suffix.lower() in (".json", *_YAML_SUFFIXES)


def read_document(path: str | PathLike[str]) -> Any:
    """Returns the content of a JSON or YAML file (`.yaml`, `.yml`) as dicts, lists and scalars. Raises `MmpError`.

    Text from a name without suffix, such as a pipe, is YAML unless it begins like an object or a list of JSON.
    """
    suffix = Path(path).suffix.lower()
    is_yaml = suffix in _YAML_SUFFIXES
    place = Location(str(path))
    content = read_bytes(path, MAX_YAML_BYTES, "YAML") if is_yaml else read_bytes(path, _most_bytes, "JSON")
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
    if is_yaml:
        return parse_yaml(text, place)
    return parse_json(text, place, MOST_PLAN_COLLECTIONS if _PLAN.match(content) else MOST_COLLECTIONS)


def _most_bytes(beginning: bytes) -> int:
    """Returns the largest size of a JSON file with this beginning: plans, which name their schema first, are larger."""
    return MAX_PLAN_BYTES if _PLAN.match(beginning) else MAX_JSON_BYTES


def parse_json(text: str, place: Location, most_collections: int = MOST_COLLECTIONS) -> Any:
    """Returns the value of a JSON text. It may hold NaN and infinity, so that later messages can name their fields.

    Raises `NotJsonError` for text that is not JSON, and `MmpError` for other faults.
    """

    def whole(digits: str) -> int | float:
        return int(digits) if len(digits) <= LONGEST_INTEGER else float(digits)

    if text.count("[") + text.count("{") > most_collections:
        raise MmpError(f"{place} has more than {most_collections:,} lists and objects, the most that are read")
    try:
        with named(place):
            return json.loads(text, object_pairs_hook=unique, parse_int=whole)
    except json.JSONDecodeError as error:
        raise NotJsonError(f"{place} is not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    except RecursionError:
        raise MmpError(f"{place} is nested too deeply; the files of mmp-env need no more than ten levels") from None


def parse_yaml(text: str, place: Location) -> Any:
    """Returns the value of a YAML document, see `yaml_value`. Raises `MmpError`."""
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
    """Returns `value`, a list of `count` finite numbers, one for each `of` in messages. Raises `MmpError`."""
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
    """Returns `data` as a `kind`, a msgspec `Struct`. Raises `MmpError` with the field; for a typo, the nearest one."""
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
    for name, index, _ in re.findall(r"\.(\w+)|\[(\d+)\]|(\[\.\.\.\])", path.rstrip("`")):
        key = name or (int(index) if index else _first_wrong(value, owner))
        place, value, owner = place / key, value[key], _inside(owner, name) if name else owner
    if unknown := re.match(r"Object contains unknown field `(.*)`", message, re.DOTALL):
        known = [f.encode_name for f in msgspec.structs.fields(owner)]
        raise MmpError(f"{place}: {UnknownNameError('field', shown(unknown[1])[1:-1], known)}")
    if missing := re.match(r"Object missing required field `(.*)`", message):
        raise MmpError(f"{place / missing[1]} is missing")
    allowed = re.match(r"Expected (.*?)(, got .*)?$", message)
    words = re.sub(r"`([^`]*)`", lambda found: _in_words(found[1]), allowed[1]) if allowed else "a number in range"
    raise place.wrong(value, words)


def _first_wrong(mapping: dict[str, Any], kind: Any) -> str:
    """Returns the first name in a mapping whose value is no `kind`, or does not fit a mapping that `kind` allows."""
    kind = next((get_args(one)[1] for one in (kind, *get_args(kind)) if get_origin(one) is dict), kind)
    for name, value in mapping.items():
        try:
            msgspec.convert(value, kind)
        except msgspec.ValidationError:
            return name
    raise ValueError(f"every value is a {kind}")


def decode_file(data: Any, schema: str, kind: type[T], where: str | Location) -> tuple[Location, T]:
    """Returns the place of a file's data, and the data as `kind`.

    Args:
        data: the content of the file.
        schema: the schema that it must name.
        kind: a struct with the fields of the schema.
        where: the place, or the name of the file.

    Raises:
        MmpError: for another schema, and for malformed data, with field and value.
    """
    place = where if isinstance(where, Location) else Location(where)
    check_schema(data, schema, place)
    return place, decode(data, kind, place)


def _beyond_floats(data: Any, place: Location) -> Iterator[tuple[Location, int]]:
    """Yields the whole numbers that no float can hold, with their places. Only Python code makes such data."""
    if isinstance(data, int) and abs(data) > sys.float_info.max:
        yield place, data
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list | tuple) else ()
    for key, item in items:
        yield from _beyond_floats(item, place / key)


def _in_words(types: str) -> str:
    return " or ".join(_PLAIN_WORDS.get(name, name) for name in types.split(" | "))


def _inside(owner: Any, field: str) -> Any:
    """Returns the `Struct` in a field of a `Struct`, alone, in a list or in a union; or the type of the field."""
    inner = {f.encode_name: f.type for f in msgspec.structs.fields(owner)}[field]
    return next((part for part in get_args(inner) if hasattr(part, "__struct_fields__")), inner)


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns the object of these fields. Raises `MmpError` for a repeated field."""
    out = dict(pairs)
    if len(out) < len(pairs):
        [(twice, _)] = Counter(name for name, _ in pairs).most_common(1)
        raise MmpError(f"it has the field {shown(twice)} twice in one object; names must differ")
    return out
