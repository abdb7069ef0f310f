"""Writes whole files or none, and JSON with the same bytes for the same values."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import re
import stat
from collections.abc import Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env import argument_checks
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_file, real_path, refusal
from mmp_env.files.temporaries import beside

_LINE = 240
"""Longest line of an object or list of objects or lists."""
_NESTED = (dict, list)
_STRANGE = re.compile(r"^\.|[^\w .+=@-]", re.ASCII)
_LONGEST_FILE_NAME = 100


def json_text(value: Any) -> str:
    """Returns `value` as JSON, with a line for each object or list that is short or holds only scalars.

    The text is ASCII; other characters are escaped. Floats are written like `repr`. NumPy scalars and arrays become
    numbers and lists. Numbers that are not finite become null.
    """
    return _layout(plain(value), "") + "\n"


def plain(value: Any) -> Any:
    """Returns `value` in dicts, lists and scalars of JSON. Raises `TypeError` for a type that JSON lacks."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, np.ndarray | np.generic):
        numbers = value.dtype.kind in "biuf" and bool(np.isfinite(value).all())
        value = value.tolist()
        if numbers:
            return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        if {*map(type, value)} == {float} and all(map(math.isfinite, value)):  # nearly everything is a row of these
            return list(value)
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    raise TypeError(f"a value of type {type(value).__name__} cannot be written as JSON")


def check_file_name(path: str | PathLike[str]) -> None:
    """Raises `MmpError` for a path that ends in a slash, as only the path of a folder does."""
    if os.path.basename(path) in ("", "."):
        raise MmpError(f"{path} cannot be written: it ends like the path of a folder; give the name of a file")


def check_writable(path: str | PathLike[str]) -> None:
    """Raises `MmpError` if `write_text` could not write this file. Leaves nothing behind."""
    target = _target(path)
    with beside(target) as temporary:
        try:
            temporary.open("x").close()
        except OSError as error:
            raise refusal(path, "written", error) from None


def write_text(path: str | PathLike[str], text: str) -> None:
    """Writes a whole file or none: a temporary file beside it, which is then moved. Raises `MmpError`."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def whole_file(path: str | PathLike[str]) -> Iterator[Path]:
    """Yields a temporary path to write to, and moves that file to `path` in the end, or removes it after an error.

    Raises `MmpError` for a refusal of the system.
    """
    target = _target(path)
    with beside(target) as temporary:
        try:
            if target.exists():
                temporary.touch(0o600)  # private until it has the mode of the file that it replaces
            yield temporary
            move_onto(temporary, target)
        except OSError as error:
            raise refusal(path, "written", error) from None


def move_onto(new: Path, target: Path) -> None:
    """Moves a file onto another one, and keeps the mode of that one. Raises `OSError`."""
    with contextlib.suppress(FileNotFoundError):
        there = target.lstat()
        if stat.S_ISREG(there.st_mode):
            new.chmod(stat.S_IMODE(there.st_mode))
    os.replace(new, target)


def file_name(name: str) -> str:
    """Returns a safe file name, with a hash if file systems or shells may misread the name."""
    tame = _STRANGE.sub("_", name)[:_LONGEST_FILE_NAME]
    return tame if tame == name else f"{tame}-{hashlib.sha256(name.encode(errors='surrogatepass')).hexdigest()[:8]}"


def left_alone(paths: Iterable[str]) -> list[str]:
    """Returns a sentence for each path with a file that this run did not write."""
    return [f"{path} is left as it was; this run wrote nothing to it" for path in paths if os.path.exists(path)]


def _target(path: str | PathLike[str]) -> Path:
    """Returns the regular file behind any links. Raises `MmpError` for a folder or device, which a move would replace.

    A move would also replace a file without write permission, so it is refused too. So is a path that ends in a slash,
    since the file would have another name.
    """
    target = real_path(argument_checks.path("path", path))
    there = exists(target)
    if there and not is_file(target):
        raise MmpError(f"{path} cannot be written: it is not a regular file")
    check_file_name(path)
    if not there:
        return target
    try:
        os.close(os.open(target, os.O_WRONLY))
    except OSError as error:
        raise refusal(path, "written", error) from None
    return target


def _layout(value: Any, indent: str) -> str:
    inner = indent + " "
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    if not any(isinstance(part, _NESTED) for part in parts):
        return json.dumps(value)
    lines = [_layout(part, inner) for part in parts]
    if isinstance(value, dict):
        lines = [f"{json.dumps(key)}: {line}" for key, line in zip(value, lines, strict=True)]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    if sum(map(len, lines)) + 2 * len(lines) <= _LINE:  # then none of them has a break
        return opening + ", ".join(lines) + closing
    return f"{opening}\n{inner}" + f",\n{inner}".join(lines) + f"\n{indent}{closing}"
