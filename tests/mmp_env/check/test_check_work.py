"""The checker's work is bounded: it reports undecided steps as not proved."""

import numpy as np
import pytest
from support import tiny_plans
from support.tiny_plans import UPRIGHT

from mmp_env import check_plan
from mmp_env.check.items import Bounds, Items, Touch
from mmp_env.check.model import CellModel
from mmp_env.check.reading import read_cell
from mmp_env.check.rules import MOST_TURN_RAD
from mmp_env.check.shortfalls import shortfall_violations
from mmp_env.check.sweep import MOST_MEASURED, MOST_PER_ITEM, prove_apart
from mmp_env.check.trajectory import Trajectory

MODEL = CellModel(read_cell({"arms": [tiny_plans.arm("arm", [0.0, 0.0, 0.0])]}))
STEPS = 10
PATH = Trajectory(np.array([0.0, 1.0]), np.outer([0.0, 1.0], 0.1 * STEPS * np.eye(6)[0]))


class Undecided:
    """One pair whose lower bound stays at `lower` [m], while its sampled clearance is 1 m."""

    rule = "self"

    def __init__(self, lower):
        self.lower, self.measured = lower, 0

    def __len__(self):
        return 1

    def coarse(self, poses, steps, cutoff):
        count = len(steps.start)
        return Items(steps=steps, step=np.arange(count), pair=np.zeros(count, dtype=int)), np.full(count, -np.inf)

    def narrow(self, poses, items, target):
        self.measured += len(items)
        assert self.measured < 10 * MOST_MEASURED
        ones = np.ones(len(items))
        return Bounds.of(items, self.lower * ones, ones, ones)

    def names(self, pair):
        return Touch(rule=self.rule, arms=("arm",), things=("arm/one", "arm/other"))


@pytest.mark.parametrize("lower", [-0.5, 0.0005])
def test_steps_that_no_bisection_decides_are_not_proved(lower):
    family = Undecided(lower)
    sweep = prove_apart(MODEL, [family], PATH, {"self": 0.001})
    assert STEPS < family.measured <= MOST_MEASURED + (MOST_PER_ITEM + 1) * STEPS
    assert not any(short.found for short in sweep.shortfalls)
    (violation,) = shortfall_violations(sweep)
    said = "overlap by 500.00 mm" if lower < 0 else "come as close as 0.5000 mm"
    assert violation.message.startswith(f"not proved: arm/one and arm/other may {said}")


def test_a_sufficient_clearance_is_proved_if_a_better_one_cannot_be():
    sweep = prove_apart(MODEL, [Undecided(0.002)], PATH, {"self": 0.001})
    assert sweep.shortfalls == []
    assert sweep.proved == 0.002


def test_a_motion_of_hours_is_refused_with_its_length():
    turns = int(MOST_TURN_RAD / 12) + 1
    rows = [[sign * 6.0, *UPRIGHT[1:]] for _ in range(turns // 2 + 1) for sign in (-1.0, 1.0)]
    plan = tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": rows})
    report = check_plan(plan)
    (violation,) = report.violations
    assert violation.rule == "length"
    assert violation.message.startswith("not proved: joints turn by 100")
    assert report.min_clearance_m is None
    assert report.instants == 0
