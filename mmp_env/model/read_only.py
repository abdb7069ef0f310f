"""Read-only values: frozen dataclasses whose mappings and arrays are read-only too, also in copies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NoReturn, TypeVar

import numpy as np

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


def _refuse(*args: Any, **keywords: Any) -> NoReturn:
    raise TypeError("this mapping is read-only; change a copy of it: dict(mapping)")


class ReadOnlyDict(dict[_Key, _Value]):
    """A dict that refuses changes. It pickles and deep-copies; `dict(it)` and `it | other` are ordinary dicts."""

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Callable[[Any], Any], tuple[dict[_Key, _Value]]]:
        return read_only, (dict(self),)  # NumPy forgets in copies and pickles that an array was read-only


class ReadOnly:
    """Base of frozen dataclasses. Makes their mappings and arrays read-only when they are made, copied or unpickled."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            frozen = read_only(value)
            if frozen is not value:
                object.__setattr__(self, name, frozen)

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, read_only(value))


_NOTHING_TO_DO = frozenset((str, int, float, bool, type(None), ReadOnlyDict))
"""Types of most values in statistics and options; to ask about `Mapping` takes ten times as long."""


def read_only(value: Any) -> Any:
    """Returns a read-only view of an array, or a read-only copy of a mapping with its mappings and arrays.

    Any other value is returned as it is.
    """
    if type(value) in _NOTHING_TO_DO:
        return value
    if isinstance(value, np.ndarray) and value.flags.writeable:
        value = value.view()
        value.flags.writeable = False
    elif type(value) is dict or (isinstance(value, Mapping) and not isinstance(value, ReadOnlyDict)):
        return ReadOnlyDict({key: read_only(item) for key, item in value.items()})
    elif type(value) is tuple and any(isinstance(item, np.ndarray) for item in value):
        return tuple(map(read_only, value))
    return value
