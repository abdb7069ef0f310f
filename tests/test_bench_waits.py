"""`scripts/bench_waits.py`: the wait of the arm that arrives last."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest
from support import checkout_scripts


@pytest.fixture
def wait_of_last_arm(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("bench_waits").wait_of_last_arm


TIMES = np.array([0.0, 1.0, 1.5, 3.0, 3.5, 4.0])


def plan(**angles):
    return SimpleNamespace(
        times=TIMES, positions={name: np.array(values, dtype=float)[:, None] for name, values in angles.items()}
    )


@pytest.mark.parametrize(
    ("last", "wait"),
    [
        ([0, 1, 2, 3, 4, 5], 0.0),
        ([0, 0, 1, 1, 2, 2], 1.0 + 1.5),  # the half second after its arrival is no wait
        ([0, 1, 1, 1, 2, 3], 0.5 + 1.5),
    ],
)
def test_only_what_the_last_arm_waits_before_it_arrives_counts(wait_of_last_arm, last, wait):
    first = [0, 0, 1, 1, 1, 1]
    assert wait_of_last_arm(plan(first=first, last=last)) == pytest.approx(wait)
    assert wait_of_last_arm(plan(last=last, first=first)) == pytest.approx(wait)


def test_a_plan_in_which_nothing_moves_has_no_wait(wait_of_last_arm):
    assert wait_of_last_arm(plan(still=[1] * 6)) == 0.0
