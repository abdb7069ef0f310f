"""The certificate of many arms, which looks at arms that come close, against certificates of every two arms."""

from functools import cache
from itertools import combinations

import numpy as np
import pytest

from mmp_env import core, find_cell
from mmp_env.model.cell import Cell

CELL = find_cell("line-10")
HOME = np.array([0.0, -1.5, 1.2, -1.2, -1.5, 0.0])
SAMPLES = 5
FAR_M = 100.0
CLOCK = core.Clock(60.0)


def motion(seed, length):
    """Returns positions [SAMPLES, dof] of each arm: steps of random direction from a place near HOME."""
    rng = np.random.default_rng(seed)
    steps = length * rng.uniform(-1.0, 1.0, (len(CELL.arms), SAMPLES, len(HOME)))
    return list(HOME + rng.uniform(-0.3, 0.3, (len(CELL.arms), 1, 6)) + np.cumsum(steps, axis=1))


@cache
def cell_of(arms):
    return Cell(name="some", arms=tuple(CELL.arms[a] for a in arms), obstacles=CELL.obstacles)


def certificate(arms, q, required_m):
    """Returns the certificate of some arms, to which the others do not exist."""
    cell = cell_of(tuple(arms))
    levels = core.Levels(margin=required_m, proof=required_m, obstacles=-1.0, own=-1.0)  # so that pairs decide
    return core.certify(cell.collision.core, [q[a] for a in arms], levels, 1.0, CLOCK)


def of_all_pairs(q, required_m):
    return {pair: certificate(pair, q, required_m) for pair in combinations(range(len(CELL.arms)), 2)}


def with_rests(seed, length):
    """Returns positions of each arm over hundreds of segments, in which the arms often stand; the first one always."""
    rng = np.random.default_rng(seed)
    steps = length * rng.uniform(-1.0, 1.0, (len(CELL.arms), 330, len(HOME)))
    steps[np.repeat(rng.random((len(CELL.arms), 33)) < 0.6, 10, axis=1)] = 0.0
    for arm, jump in enumerate(rng.integers(300, size=len(CELL.arms))):  # far in one segment; then the arm stands
        steps[arm, jump] = rng.uniform(-0.2, 0.2, len(HOME))
        steps[arm, jump + 1 : jump + 9] = 0.0
    steps[0] = 0.0
    return list(HOME + np.cumsum(steps, axis=1))


@pytest.mark.parametrize(("length", "fractions"), [(0.8, {0.0, 0.5}), (0.02, {0.0})])
def test_the_sampled_clearance_is_the_least_of_all_pairs(length, fractions):
    seen = set()
    for seed in range(8):
        q = motion(seed, length)
        found = certificate(range(len(CELL.arms)), q, FAR_M)
        pairs = of_all_pairs(q, FAR_M)
        assert not found.valid
        assert found.clearance == pytest.approx(min(proof.clearance for proof in pairs.values()), abs=1e-12)
        seen.add(found.fraction)
    assert seen == fractions


@pytest.mark.parametrize("length", [0.02, 0.4, 0.8])
def test_a_plan_is_proved_if_every_pair_of_its_arms_is(length):
    for seed in range(6):
        q = motion(seed, length)
        found = certificate(range(len(CELL.arms)), q, 1e-4)
        pairs = of_all_pairs(q, 1e-4)
        assert found.valid == all(proof.valid for proof in pairs.values())


def test_a_long_plan_with_rests_is_proved_if_every_segment_of_every_two_arms_is():
    outcomes = set()
    for seed, length in enumerate((0.01, 0.03, 0.06, 0.12)):
        q = with_rests(seed, length)
        found = certificate(range(len(CELL.arms)), q, 1e-4)
        free = all(
            certificate((a, b), [rows[k : k + 2] for rows in q], 1e-4).valid
            for a, b in combinations(range(len(CELL.arms)), 2)
            for k in range(len(q[0]) - 1)
            if k == 0 or not np.array_equal(q[a][k], q[a][k + 1]) or not np.array_equal(q[b][k], q[b][k + 1])
        )
        assert found.valid == free
        outcomes.add(free)
    assert outcomes == {True, False}


def test_a_plan_of_one_instant_is_proved_by_its_sample():
    q = [rows[:1] for rows in motion(0, 0.3)]
    found = certificate(range(len(CELL.arms)), q, 1e-4)
    assert found.valid == all(proof.valid for proof in of_all_pairs(q, 1e-4).values())
