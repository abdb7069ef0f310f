"""Calls of the native core with hostile arguments. Any answer will do but a crash, or one that takes too long."""

from __future__ import annotations

import math
import mmap
import random
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from support.core_calls import CALLS
from support.core_objects import CELL
from support.wrong_arguments import WRONG

NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e-310, 1e300, -1e300, math.nan, math.inf, -math.inf, 1e6, 1e4, 0.1, 3.0]
WHOLE = [0, 1, 2, -1, 7, 2**31 - 1, -(2**31), 2**31, 2**63 - 1, 2**64, 10**30]
OBJECTS = [None, "x", b"x", [], {}, object(), 3, 0.5, True, [None], np.zeros(0), np.array(1.0), CELL]
TYPES = [np.float64, np.float32, np.int32, np.int64, np.int8, np.uint8, np.bool_, np.complex128, object]


def run(seed: str, calls: int, place: Path) -> dict[str, Any]:
    """Makes calls. Writes the number of each to `place` before it. Returns how many returned and how many raised."""
    warnings.simplefilter("ignore")
    with place.open("r+b") as file, mmap.mmap(file.fileno(), 8) as number:
        returned = 0
        for k in range(calls):
            number[:] = struct.pack("q", k)
            returned += attempt(name_of(seed, k), f"{seed}/{k}")
    return {"calls": calls, "returned": returned}


def name_of(seed: str, k: int) -> str:
    """Returns the name of the function that call `k` calls."""
    return random.Random(f"{seed}/{k}").choice(sorted(CALLS))


def attempt(name: str, seed: str) -> bool:
    """Calls a function with arguments that its name and `seed` determine. Returns whether it returned."""
    arguments = arguments_of(name, random.Random(seed))
    try:
        CALLS[name].of(**arguments)
    except Exception:
        return False
    return True


def arguments_of(name: str, rng: random.Random) -> dict[str, Any]:
    """Returns the arguments of a call: one or more of them hostile."""
    chosen = CALLS[name]
    arguments = dict(chosen.valid)
    for key in rng.sample(sorted(arguments), rng.choice([0, 1, 1, 1, 2, 3])) if len(arguments) > 3 else arguments:
        kind = chosen.arguments[key][1]
        wrong = WRONG[kind]
        arguments[key] = rng.choice(wrong) if wrong and rng.random() < 0.4 else hostile(arguments[key], rng)
    return arguments


def hostile(value: Any, rng: random.Random) -> Any:
    """Returns a hostile value in place of a valid one."""
    if rng.random() < 0.1:
        return rng.choice(OBJECTS)
    if isinstance(value, np.ndarray):
        return hostile_array(value, rng)
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
    kind = rng.randrange(9)
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
    return rng.choice([out * rng.choice([1e-3, 0.5, 2, 1e3]) if out.dtype.kind == "f" else out, out.tolist()])
