"""The core refuses every wrong argument with a sentence; each function is tried in a process of its own."""

import inspect
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import core_calls, core_objects

from mmp_env import core

PYTHONPATH = os.pathsep.join(filter(None, [str(Path(core_calls.__file__).parents[1]), os.environ.get("PYTHONPATH")]))
REFUSALS = ("ValueError", "TypeError")


def offered() -> set[str]:
    """Returns the names of all functions and methods of the core."""
    names = set()
    for name, value in vars(core.load_variant(core.preferred_variant())).items():
        if name.startswith("_"):
            continue
        if inspect.isclass(value):
            methods = {m for m, f in vars(value).items() if callable(f) or isinstance(f, staticmethod)}
            own = {m for m in methods if not m.startswith("_")}
            names |= {f"{name}.{m}" for m in own | ({"__init__"} & methods)}
        elif callable(value):
            names.add(name)
    return names


def test_every_function_of_the_core_is_tried():
    without = {f"{made}.__init__" for made in ("Constraint", "ModifiedMotion", "NearestBodies", "Proof")}
    assert offered() - without == set(core_calls.CALLS)


@pytest.mark.parametrize("name", core_calls.CALLS)
def test_wrong_arguments_of_the_core_are_refused(name):
    done = subprocess.run(
        [sys.executable, "-P", "-m", core_calls.__name__, name],
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, f"ended with {done.returncode} at {lines[-1:]}\n{done.stderr}"
    outcomes = [(tried["try"], came["outcome"]) for tried, came in zip(lines[::2], lines[1::2], strict=True)]
    assert outcomes[0] == ("valid", "returned")
    assert [(what, came) for what, came in outcomes[1:] if not came.startswith(REFUSALS)] == []
    assert [what for what, came in outcomes[1:] if came.strip() in {f"{name}:" for name in REFUSALS}] == []


def test_a_cell_is_finished_once_and_not_without_arms():
    cell = core_objects.two_arms()
    with pytest.raises(ValueError, match="the cell is frozen"):
        cell.freeze()
    with pytest.raises(ValueError, match="the cell is frozen"):
        cell.add_arm(**core_objects.arm_at(0.0))
    with pytest.raises(ValueError, match="the cell is frozen"):
        cell.add_obstacle(**core_objects.obstacle())
    with pytest.raises(ValueError, match="one arm at least"):
        core.Cell().freeze()


def test_an_unfinished_cell_refuses_queries():
    cell = core_objects.two_arms(frozen=False)
    with pytest.raises(ValueError, match="the cell is not frozen"):
        core.conflict_instants(cell, [], np.zeros((0, 2), dtype=np.int32), core_objects.MARGINS)


@pytest.mark.parametrize("seconds", [0.0, -1.0, -1e300, -math.inf])
def test_a_clock_without_time_has_expired(seconds):
    clock = core.Clock(seconds)
    assert clock.expired
    assert clock.remaining <= 0


@pytest.mark.parametrize("seconds", [1e300, math.inf])
def test_a_clock_with_endless_time_has_not(seconds):
    clock = core.Clock(seconds)
    assert not clock.expired
    assert clock.remaining == math.inf
