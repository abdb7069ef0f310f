"""Judges what a call of the native core raised or returned, by the docstrings of mmp_env/_core.pyi."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mmp_env.errors import MmpError

REFUSALS = (ValueError, TypeError, MmpError)
"""Exceptions that refuse an argument. nanobind raises `TypeError` for one that it cannot convert."""
HUGE = 10**6
"""Number of elements of a huge array. Only with such an argument there may be too little memory."""
MAY_BE_INFINITE = ("lower", "upper")
"""Arrays of limits, in which infinity is no limit."""
Shape = tuple[int | str, ...]
"""Lengths of a result: a number, or a name of a length that is the same wherever the name is."""
_Arguments = dict[str, Any]


def _rows(key: str, *lengths: int | str) -> Callable[[_Arguments], list[Shape]]:
    """Returns a function that says that a result has a row for each row of an argument."""
    return lambda given: [(len(given[key]), *lengths)]


SHAPES: dict[str, Callable[[_Arguments], list[Shape]]] = {
    "spheres": _rows("q", "spheres", 3),
    "sphere_table": lambda _: [("spheres", 2)],
    "tool_points": _rows("q", 3),
    "tool_axes": _rows("q", 3),
    "static_clearance": _rows("q"),
    "pair_clearance": _rows("qa"),
    "swept_clearance": lambda given: [(len(given["q"]) - 1,)],
    "cell_clearance": lambda given: [(len(given["q"][0]),)],
    "edges_free": _rows("q_from"),
    "project_upright": lambda given: [np.shape(given["q"]), (len(given["q"]),)],
    "hull_distances": _rows("poses", 2),
    "deepest_balls": lambda given: [(len(given["points"]),)] * 2,
    "points_in_balls": lambda _: [("found",)] * 2,
    "plane_depths": _rows("points"),
    "small_cover": lambda _: [("chosen",)],
    "solve_six_hinges": lambda _: [("found", 6), ("found", 1)],
    "refine_tool_pose": lambda given: [("found", np.shape(given["q"])[1]), ("found", 1)],
    "self_motions": lambda given: [("found", np.shape(given["q"])[1])],
    "with_turns": lambda given: [("found", np.shape(given["q"])[1]), ("found", 1)],
    "safe_intervals": lambda _: [("intervals", 2)],
    "repulsive_force": lambda _: [("steps", 2)],
    "PathRecombination.path": lambda _: [("steps", 2)],
    "swept_conflicts": lambda _: [("steps", "others")],
    "replan": lambda _: [("steps", 2)] * 2,
    "shortcut": lambda _: [("steps", 2)] * 2,
    "remove_waits": lambda _: [("steps", 2)] * 2,
    "PathRecombination.recombine": lambda _: [("steps", 2)] * 2,
    "SingleArm.plan": lambda _: [("steps", 2)],
    "CompositeSearch.grow": lambda _: [("steps", 4)],
    "GroupSearch.grow": lambda _: [("steps", 4)],
}
"""Function -> the shapes of the arrays that it returns. An empty tuple stands for no array, if it found nothing."""


def exception_fault(error: Exception, arguments: _Arguments) -> str:
    """Returns why an exception is a fault; nothing for one that refuses an argument."""
    if isinstance(error, REFUSALS):
        return ""
    is_large = any(array.size >= HUGE for value in arguments.values() for array in arrays_of(value))
    if isinstance(error, MemoryError) and is_large:
        return ""
    return f"raised {type(error).__name__}: {error}".splitlines()[0]


def result_fault(name: str, arguments: _Arguments, result: Any) -> str:
    """Returns why a result is nonsense for the arguments of a call, or nothing."""
    return next(_faults(name, arguments, result), "")


def arrays_of(value: Any) -> Iterator[np.ndarray]:
    """Yields all arrays in a value."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from arrays_of(item)


def _faults(name: str, arguments: _Arguments, result: Any) -> Iterator[str]:
    for key, value in arguments.items():
        for array in arrays_of(value):
            if array.dtype.kind in "fc" and not _is_finite(array, may_be_infinite=key in MAY_BE_INFINITE):
                yield f"took {key} with a number that is not finite"
    found = list(arrays_of(result))
    lengths: dict[str, int] = {}
    if name in SHAPES and found:
        wanted = SHAPES[name](arguments)
        if len(found) != len(wanted) or not all(
            _is_shape(array.shape, shape, lengths) for array, shape in zip(found, wanted, strict=True)
        ):
            yield f"returned arrays of shapes {[array.shape for array in found]}, not {wanted}"
    for array in found:
        if name == "hull_distances":
            array = np.where(np.isneginf(array) & [True, False], 0.0, array)  # a lower bound where hulls overlap
        if name == "deepest_balls" and not len(arguments["radii"]):
            continue  # every point is infinitely far from no balls
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            yield "returned a number that is not finite"
    clearance = getattr(result, "clearance", 0.0)
    if isinstance(clearance, float) and not np.isfinite(clearance):
        yield f"returned the clearance {clearance}"


def _is_finite(array: np.ndarray, *, may_be_infinite: bool) -> bool:
    return not np.isnan(array).any() if may_be_infinite else bool(np.isfinite(array).all())


def _is_shape(shape: Shape, wanted: Shape, lengths: dict[str, int]) -> bool:
    """Returns whether a shape is the wanted one, and sets the lengths that only have a name so far."""
    return len(shape) == len(wanted) and all(
        length == (lengths.setdefault(want, int(length)) if isinstance(want, str) else want)
        for length, want in zip(shape, wanted, strict=True)
    )
