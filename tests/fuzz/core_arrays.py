"""Calls of the native core with hostile arguments: each must refuse them, or return what it says, in time."""

from __future__ import annotations

import math
import mmap
import random
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from support.core_calls import CALLS
from support.core_objects import CELL, CLOCK
from support.wrong_arguments import WRONG

from fuzz import core_results
from mmp_env import core

NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e-310, 1e300, -1e300, math.nan, math.inf, -math.inf, 1e6, 1e4, 0.1, 3.0]
WHOLE = [0, 1, 2, -1, 7, 2**31 - 1, -(2**31), 2**31, 2**63 - 1, 2**64, 10**30]
OBJECTS = [None, "x", b"x", [], {}, object(), 3, 0.5, True, [None], np.zeros(0), np.array(1.0), CELL]
CLOCK_S = 2.0
"""Time that a call with a clock has [s]."""
HUGE_SHARE = 0.001
"""Share of hostile arrays with a million elements or more, which take a thousand times as long."""
MUCH_WORK = (("conflict_instants", "pairs"), ("self_motions", "q"))
"""Arguments with so much work for each row that a million numbers take longer than the fuzzer waits."""
TYPES = [np.float64, np.float32, np.int32, np.int64, np.int8, np.uint8, np.bool_, np.complex128, object]


def run(seed: str, calls: int, place: Path) -> dict[str, Any]:
    """Makes calls. Writes the number of each to `place` before it.

    Returns how many there were, how many returned, and the faults: number of the call -> what is wrong.
    """
    warnings.simplefilter("ignore")
    with place.open("r+b") as file, mmap.mmap(file.fileno(), 8) as number:
        returned, faults = 0, {}
        for k in range(calls):
            number[:] = struct.pack("q", k)
            has_returned, fault = attempt(*call_of(seed, k))
            returned += has_returned
            if fault:
                faults[k] = fault
    return {"calls": calls, "returned": returned, "faults": faults}


def name_of(seed: str, k: int) -> str:
    """Returns the name of the function that call `k` calls."""
    return random.Random(f"{seed}/{k}").choice(sorted(CALLS))


def call_of(seed: str, k: int) -> tuple[str, dict[str, Any]]:
    """Returns the name and the arguments of call `k`."""
    name = name_of(seed, k)
    return name, arguments_of(name, random.Random(f"{seed}/{k}"))


def attempt(name: str, arguments: dict[str, Any], of: Callable[..., Any] | None = None) -> tuple[bool, str]:
    """Calls a function, or another one in its place. Returns whether it returned, and its fault, if any."""
    try:
        result = (of or CALLS[name].of)(**{key: _started(value) for key, value in arguments.items()})
    except Exception as error:
        return False, core_results.exception_fault(error, arguments)
    return True, core_results.result_fault(name, arguments, result)


def _started(value: Any) -> Any:
    """Returns a new clock in place of that of the tables, which began when this process did."""
    return core.Clock(CLOCK_S) if value is CLOCK else value


def arguments_of(name: str, rng: random.Random) -> dict[str, Any]:
    """Returns the arguments of a call: one or more of them hostile."""
    chosen = CALLS[name]
    arguments = dict(chosen.valid)
    for key in rng.sample(sorted(arguments), rng.choice([0, 1, 1, 1, 2, 3])) if len(arguments) > 3 else arguments:
        kind = chosen.arguments[key][1]
        wrong = WRONG[kind]
        value = rng.choice(wrong) if wrong and rng.random() < 0.4 else hostile(arguments[key], rng)
        if (name, key) in MUCH_WORK and isinstance(value, np.ndarray) and value.size >= core_results.HUGE:
            value = value[: core_results.HUGE // 100]
        arguments[key] = value
    return arguments


def hostile(value: Any, rng: random.Random) -> Any:
    """Returns a hostile value in place of a valid one."""
    if rng.random() < 0.1:
        return rng.choice(OBJECTS)
    if isinstance(value, np.ndarray):
        return huge_array(value, rng) if rng.random() < HUGE_SHARE else hostile_array(value, rng)
    if isinstance(value, list | tuple) and value:
        out = [hostile(item, rng) if rng.random() < 0.5 else item for item in value]
        return rng.choice([out, out[:-1], out * 2, tuple(out)])
    if isinstance(value, bool):
        return rng.choice([not value, 2, None])
    if isinstance(value, int):
        return rng.choice([value + rng.choice([-1, 1]), rng.choice(WHOLE), rng.choice(NUMBERS)])
    if isinstance(value, float):
        return rng.choice([value * rng.choice([0.5, -1, 1.001, 100]), rng.choice(NUMBERS)])
    return rng.choice(OBJECTS)


def hostile_array(value: np.ndarray, rng: random.Random) -> Any:
    """Returns an array of another shape, type or layout, or with other numbers."""
    kind = rng.randrange(10)
    out = np.array(value)
    if kind <= 2 and out.size:
        flat = out.reshape(-1)
        for _ in range(rng.randint(1, 3)):
            with np.errstate(all="ignore"):
                flat[rng.randrange(flat.size)] = rng.choice(NUMBERS if out.dtype.kind == "f" else [0, 1, -1, 2, 100])
        return out
    if kind == 3:
        with np.errstate(all="ignore"):
            return out.astype(rng.choice(TYPES))
    if kind == 4:
        return np.repeat(out[None], rng.choice([0, 1, 2]), axis=0)
    if kind == 5 and out.ndim:
        return np.concatenate([out] * rng.choice([2, 3, 50])) if rng.random() < 0.5 else out[: rng.randint(0, len(out))]
    if kind == 6 and out.ndim:
        return np.repeat(out, 2, axis=-1)[..., ::2]
    if kind == 7:
        return np.asfortranarray(out) if out.ndim > 1 else out[::-1]
    if kind == 8 and out.size:  # all elements, or all rows, are one in memory
        return np.broadcast_to(out[:1] if rng.random() < 0.5 and out.ndim else out.flat[0], out.shape)
    return rng.choice([out * rng.choice([1e-3, 0.5, 2, 1e3]) if out.dtype.kind == "f" else out, out.tolist()])


def huge_array(value: np.ndarray, rng: random.Random) -> np.ndarray:
    """Returns an array of a million elements: rows of the given one, its first row, or zeros."""
    rows = core_results.HUGE // max(math.prod(value.shape[1:]), 1) + 1
    if not value.ndim or not value.size or rng.random() < 0.2:
        return np.zeros(core_results.HUGE, dtype=value.dtype)
    if rng.random() < 0.5:
        return np.resize(value, (rows, *value.shape[1:]))
    return np.broadcast_to(value[:1], (rows, *value.shape[1:]))
