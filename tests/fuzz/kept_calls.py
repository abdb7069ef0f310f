"""Keeps a call of the native core as text: its function and all its arguments, whatever the tables draw later.

Objects of the core, such as a cell, have a name: the argument whose valid value they are, or the kind of wrong value.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from support import core_objects
from support.core_calls import CALLS
from support.wrong_arguments import WRONG

_PLAIN = (bool, int, float, str, type(None))


def to_json(name: str, arguments: dict[str, Any]) -> str:
    """Returns a call as text."""
    kept = {key: _kept(value) for key, value in arguments.items()}
    return json.dumps({"name": name, "arguments": kept}, indent=1) + "\n"


def from_json(text: str) -> tuple[str, dict[str, Any]]:
    """Returns the function and the arguments of `to_json`."""
    data = json.loads(text)
    return data["name"], {key: _value(kept) for key, kept in data["arguments"].items()}


def _kept(value: Any) -> Any:
    if isinstance(value, _PLAIN):
        return value
    if isinstance(value, list):
        return [_kept(item) for item in value]
    if isinstance(value, tuple):
        return {"tuple": [_kept(item) for item in value]}
    if isinstance(value, bytes):
        return {"bytes": base64.b64encode(value).decode()}
    if isinstance(value, dict):
        return {"dict": {key: _kept(item) for key, item in value.items()}}
    if isinstance(value, np.ndarray | np.generic):
        return _kept_array(np.asarray(value))
    return {"object": None} if type(value) is object else {"native": _names()[id(value)]}


def _kept_array(array: np.ndarray) -> dict[str, Any]:
    """Returns an array with its layout: the bytes that it spans, and its strides."""
    if array.dtype.kind == "O":
        return {"shape": array.shape, "objects": [_kept(item) for item in array.ravel().tolist()]}
    first, size = _span(array.shape, array.strides, array.itemsize)
    content = bytearray(size)
    np.ndarray(array.shape, array.dtype, content, first, array.strides)[...] = array
    kept = base64.b64encode(zlib.compress(content, 9)).decode()
    return {"shape": array.shape, "dtype": array.dtype.str, "strides": array.strides, "bytes of array": kept}


def _span(shape: tuple[int, ...], strides: tuple[int, ...], itemsize: int) -> tuple[int, int]:
    """Returns where the first element of an array is in the bytes that it spans, and the number of these bytes."""
    if 0 in shape:
        return 0, 0
    ends = [(length - 1) * stride for length, stride in zip(shape, strides, strict=True)]
    first = -sum(min(end, 0) for end in ends)
    return first, first + sum(max(end, 0) for end in ends) + itemsize


def _value(kept: Any) -> Any:
    if isinstance(kept, list):
        return [_value(item) for item in kept]
    if not isinstance(kept, dict):
        return kept
    if "tuple" in kept:
        return tuple(_value(item) for item in kept["tuple"])
    if "bytes" in kept:
        return base64.b64decode(kept["bytes"])
    if "dict" in kept:
        return {key: _value(item) for key, item in kept["dict"].items()}
    if "objects" in kept:
        out = np.empty(len(kept["objects"]), dtype=object)
        out[:] = [_value(item) for item in kept["objects"]]
        return out.reshape(kept["shape"])
    if "shape" in kept:
        shape, strides = tuple(kept["shape"]), tuple(kept["strides"])
        content = bytearray(zlib.decompress(base64.b64decode(kept["bytes of array"])))
        dtype = np.dtype(kept["dtype"])
        return np.ndarray(shape, dtype, content, _span(shape, strides, dtype.itemsize)[0], strides)
    return object() if "object" in kept else dict(_named())[kept["native"]]


def _names() -> dict[int, str]:
    """Returns the identity of each native object in the tables -> its first name."""
    out: dict[int, str] = {}
    for name, item in _named():
        out.setdefault(id(item), name)
    return out


def _named() -> Iterator[tuple[str, Any]]:
    """Yields name and object of all native objects in the tables."""
    yield from ((name, item) for name, item in vars(core_objects).items() if name.isupper() and _is_native(item))
    for call, chosen in CALLS.items():
        for key, value in chosen.valid.items():
            yield from ((f"{call} {key} {k}", item) for k, item in enumerate(_native(value)))
    for kind, values in WRONG.items():
        yield from ((f"wrong {kind} {k}", item) for k, item in enumerate(_native(values)))


def _native(value: Any) -> Iterator[Any]:
    if isinstance(value, list | tuple):
        for item in value:
            yield from _native(item)
    elif _is_native(value):
        yield value


def _is_native(value: Any) -> bool:
    return type(value).__module__.startswith("mmp_env._core")
