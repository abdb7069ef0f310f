"""`scripts/bench_nodes.py`: travel of the arm that arrives last, and the rest of its time."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest
from support import checkout_scripts

TIMES = np.array([0.0, 1.0, 1.5, 3.0, 3.5, 4.0])


@pytest.fixture
def rest_and_travel(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("bench_nodes").rest_and_travel


def plan(**angles):
    positions = {name: np.array(values, dtype=float)[:, None] for name, values in angles.items()}
    problem = SimpleNamespace(max_velocity=dict.fromkeys(angles, np.array([2.0])))
    return SimpleNamespace(times=TIMES, positions=positions, problem=problem)


@pytest.mark.parametrize(
    ("last", "rest"),
    [
        ([0, 2, 3, 6, 7, 8], 0.0),  # always at its limit
        ([0, 0, 1, 1, 2, 2], 1.0 + 1.5),  # it waits twice; the half second after its arrival does not count
        ([0, 1, 2, 5, 6, 7], 0.5),  # it is slow in the first second
    ],
)
def test_the_rest_is_what_the_last_arm_waits_and_loses_by_slow_motion(rest_and_travel, last, rest):
    first = [0, 0, 1, 1, 1, 1]
    travel = np.abs(np.diff(last)).sum() / 2
    assert rest_and_travel(plan(first=first, last=last)) == pytest.approx((rest, travel))
    assert rest_and_travel(plan(last=last, first=first)) == pytest.approx((rest, travel))


def test_a_plan_in_which_nothing_moves_has_neither(rest_and_travel):
    assert rest_and_travel(plan(still=[1] * 6)) == (0.0, 0.0)
