"""The fields of an obstacle: which of them belong to its shape, and which values they take."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mmp_env.argument_checks import as_numbers, given, number, refused, text
from mmp_env.errors import MmpError, UnknownNameError

MEASURES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": ("pieces",),
}
"""Shape of a solid -> the fields that give its size. The pieces of a mesh are convex."""
SHAPES = tuple(MEASURES)
_ABOVE_0 = "lengths above 0 [m]: 3 of a box, one of the others"
_TURN = "4 finite numbers that are not all zero (wxyz)"


def check_fields(fields: Mapping[str, Any]) -> None:
    """Raises `MmpError` for an unknown shape, fields that are missing or belong to other shapes, and other values."""
    solid = f"obstacle '{text('name of an obstacle', fields['name'])}'"
    shape = text(f"shape of {solid}", fields["shape"])
    if shape not in SHAPES:
        raise UnknownNameError(f"shape of {solid}", shape, SHAPES)
    _numbers(f"position of {solid}", fields["position"], (3,), "3 finite numbers")
    if not _numbers(f"quaternion of {solid}", fields["quaternion"], (4,), _TURN).any():
        raise refused(f"quaternion of {solid}", [0, 0, 0, 0], _TURN)
    pieces = given(f"pieces of {solid}", fields["pieces"], Collection, "a tuple of arrays [v, 3] of vertices")
    has = {name: fields[name] is not None for name in ("size", "radius", "length")} | {"pieces": len(pieces) > 0}
    wanted = " and ".join(MEASURES[shape])
    for name, it_has in has.items():
        if it_has and name not in MEASURES[shape]:
            raise MmpError(f"{solid} is a {shape} with {name}; it has {wanted} only")
        if not it_has and name in MEASURES[shape]:
            raise MmpError(f"{solid} is a {shape} without {name}; it needs {wanted}")
    for name, shape_of in (("size", (3,)), ("radius", ()), ("length", ())):
        if has[name] and not (_numbers(f"{name} of {solid}", fields[name], shape_of, _ABOVE_0) > 0).all():
            raise refused(f"{name} of {solid}", np.asarray(fields[name]).tolist(), _ABOVE_0)
    for piece in pieces:
        vertices = as_numbers(piece)
        if vertices is None or vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise MmpError(f"a piece of {solid} must be an array [v, 3] of the finite coordinates of its vertices")
    if isinstance(fields["may_touch"], str) or not isinstance(fields["may_touch"], Collection):
        raise refused(f"may_touch of {solid}", fields["may_touch"], "a set or list of names")
    number(f"speed of {solid}", fields["speed"], "a speed [m/s], 0 or more", zero=True)


def _numbers(name: str, value: object, shape: tuple[int, ...], allowed: str) -> np.ndarray:
    numbers = as_numbers(value)
    if numbers is None or numbers.shape != shape or not np.isfinite(numbers).all():
        raise refused(name, value.tolist() if isinstance(value, np.ndarray) else value, allowed)
    return numbers
