"""Fields of a JSON document. Every function refuses a value that the checker cannot use."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.report import Violation
from mmp_env.mujoco_import import mujoco

SMALLEST_M, LARGEST_M = 1e-6, 100.0
"""Bounds [m] of edges, radii and lengths. Positions lie within the larger one of the origin of their frame."""
LEAST_MARGIN_M = 1e-12
"""Lower bound of margins [m]. Below is the rounding of clearances."""
LARGEST_YAW_RAD = 4 * np.pi
"""Largest yaw [rad]: two turns."""


class UnreadableError(Exception):
    """A document that the checker cannot read; `rule` is `schema` or `shape`."""

    def __init__(self, message: str, rule: str = "schema") -> None:
        super().__init__(message)
        self.violation = Violation(rule=rule, message=message)


def shown(value: Any) -> str:
    """Returns a value as text. Python refuses to write whole numbers of more than 4300 digits."""
    try:
        return repr(value)
    except ValueError:
        return f"a {type(value).__name__} that is too long to show"


def member(data: Any, key: str, where: str) -> Any:
    """Returns `data[key]` of a JSON object. Raises `UnreadableError`."""
    if not isinstance(data, Mapping):
        raise UnreadableError(f"{where} is not a JSON object")
    if key not in data:
        raise UnreadableError(f"{where} has no '{key}'")
    return data[key]


def known(data: Any, keys: Collection[str], where: str) -> None:
    """Raises `UnreadableError` for unknown keys that are not null, since they may change the geometry."""
    if not isinstance(data, Mapping):
        raise UnreadableError(f"{where} is not a JSON object")
    for key, value in data.items():
        if key not in keys and value is not None:
            raise UnreadableError(
                f"{where} has {shown(key)}, which this checker does not know; it knows {', '.join(keys)}"
            )


def listed(data: Any, key: str, where: str, *, optional: bool = False) -> list[Any]:
    """Returns a list of a JSON object, empty if it is optional and absent. Raises `UnreadableError`."""
    value = data.get(key, []) if optional else member(data, key, where)
    if not isinstance(value, list | tuple):
        raise UnreadableError(f"{key} of {where} is not a list")
    return list(value)


def text(data: Any, key: str, where: str, allowed: Collection[str] | None = None) -> str:
    """Returns a string of a JSON object, one of `allowed`. Raises `UnreadableError`."""
    value = member(data, key, where)
    if not isinstance(value, str):
        raise UnreadableError(f"{key} of {where} is not a string")
    if allowed is not None and value not in allowed:
        raise UnreadableError(f"{key} of {where} is '{value}'; known: {', '.join(allowed)}")
    return value


def name(data: Any, where: str) -> str:
    """Returns the `name` of an arm or obstacle, printable and without a slash. Raises `UnreadableError`."""
    value = text(data, "name", where)
    if not value or "/" in value or not value.isprintable():
        raise UnreadableError(f"name of {where} is {value!r}; it must have printable characters and no slash")
    return value


def numbers(value: Any, shape: tuple[int | None, ...], where: str) -> Float[np.ndarray, "..."]:
    """Returns an array of that shape (None: any length), which may hold NaN and infinity. Raises `UnreadableError`."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise UnreadableError(f"{where} is ragged", "shape") from None
    if array.size == 0 and array.dtype.kind != "O":
        array = array.astype(float)
    # A string, a null, or a whole number of more than 64 bits among the numbers changes the kind.
    is_number = array.dtype.kind in "iuf" or (array.dtype.kind == "O" and all(map(_is_number, array.flat)))
    if not is_number or _holds_truth(value):
        raise UnreadableError(f"{where} does not hold numbers only")
    if array.ndim != len(shape) or any(want not in (None, has) for want, has in zip(shape, array.shape, strict=True)):
        wanted = " x ".join("any" if want is None else str(want) for want in shape) or "one number"
        raise UnreadableError(f"{where} has shape {list(array.shape)}; it must be {wanted}", "shape")
    try:
        return array.astype(float)
    except OverflowError:
        raise UnreadableError(f"{where} holds a whole number that no float can hold") from None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _holds_truth(value: Any) -> bool:
    """Returns whether a boolean is among the numbers, which NumPy takes for 0 or 1."""
    if not isinstance(value, list | tuple):
        return isinstance(value, bool) or (isinstance(value, np.ndarray | np.generic) and value.dtype.kind == "b")
    types = set(map(type, value))
    return not types <= {int, float} and any(map(_holds_truth, value))


def positive(value: Any, where: str, shape: tuple[int, ...] = ()) -> Float[np.ndarray, "..."]:
    """Returns finite numbers above zero. Raises `UnreadableError`."""
    array = numbers(value, shape, where)
    if not (np.isfinite(array) & (array > 0)).all():
        raise UnreadableError(f"{where} must be finite and above zero")
    return array


def margin_m(value: Any, where: str, least: float = LEAST_MARGIN_M) -> float:
    """Returns a margin [m]. Raises `UnreadableError` for one that is not finite or below `least`."""
    out = float(positive(value, where))
    if out < least:
        raise UnreadableError(f"{where} is {out:g} m; it must be {least:g} m at least")
    return out


def lengths(value: Any, where: str, shape: tuple[int, ...] = ()) -> Float[np.ndarray, "..."]:
    """Returns lengths [m] within bounds. Raises `UnreadableError`."""
    array = numbers(value, shape, where)
    if not ((array >= SMALLEST_M) & (array <= LARGEST_M)).all():
        raise UnreadableError(f"{where} must be from {SMALLEST_M} to {LARGEST_M:g} m")
    return array


def pose(data: Any, where: str) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    """Returns `position` [m], and `yaw` [rad] or `quaternion` as a unit quaternion (wxyz). Raises `UnreadableError`."""
    position = numbers(member(data, "position", where), (3,), f"position of {where}")
    quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    if data.get("yaw") is not None and data.get("quaternion") is not None:
        raise UnreadableError(f"{where} has a yaw and a quaternion; it must be one of them")
    if data.get("yaw") is not None:
        yaw = float(numbers(data["yaw"], (), f"yaw of {where}"))
        if not abs(yaw) <= LARGEST_YAW_RAD:
            raise UnreadableError(f"yaw of {where} is {yaw:g}; it must be from -12.566 to 12.566 rad")
        quaternion = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
    elif data.get("quaternion") is not None:
        quaternion = numbers(data["quaternion"], (4,), f"quaternion of {where}")
    largest = np.abs(quaternion).max()
    if not ((np.abs(position) <= LARGEST_M).all() and np.isfinite(largest) and largest > 0):
        raise UnreadableError(
            f"the pose of {where} must be numbers, its position within {LARGEST_M:g} m, its quaternion not zero"
        )
    quaternion = quaternion / largest  # keeps tiny and huge numbers out of the squares
    return position, quaternion / np.linalg.norm(quaternion)


def rotation(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """Returns the rotation matrix of a unit quaternion (wxyz)."""
    out = np.empty(9)
    mujoco.mju_quat2Mat(out, quaternion)
    return out.reshape(3, 3)
