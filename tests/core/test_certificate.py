"""The certificate of many arms, which looks at arms that come close, against certificates of every two arms."""

from functools import cache
from itertools import combinations, pairwise

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


def with_rests(seed):
    """Returns positions of each arm at 330 instants: rests, and far moves of one segment; odd arms never move."""
    rng = np.random.default_rng(seed)
    steps = np.zeros((len(CELL.arms), 330, len(HOME)))
    for arm in range(0, len(CELL.arms), 2):
        moves = rng.choice(np.arange(1, 330), 60, replace=False)
        places = rng.uniform(-1.2, 1.2, (len(moves) + 1, len(HOME)))
        steps[arm, moves] = np.diff(places, axis=0)
    return list(HOME + np.cumsum(steps, axis=1))


def divided(rows, parts):
    """Returns the same motion with each segment in equal parts."""
    share = np.arange(parts)[:, None] / parts
    return np.concatenate([*(p + share * (q - p) for p, q in pairwise(rows)), rows[-1:]])


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


def test_a_contact_with_an_arm_at_rest_that_no_sample_shows_is_found():
    found = 0
    for seed in range(16):
        q = with_rests(seed)
        parts = [divided(rows, 32) for rows in q]
        for pair in combinations(range(len(CELL.arms)), 2):
            missed = certificate(pair, q, FAR_M).clearance > 0.001
            if missed and certificate(pair, parts, FAR_M).clearance < 0:
                assert not certificate(pair, q, 1e-4).valid
                found += 1
    assert found > 5


def test_a_plan_of_one_instant_is_proved_by_its_sample():
    q = [rows[:1] for rows in motion(0, 0.3)]
    found = certificate(range(len(CELL.arms)), q, 1e-4)
    assert found.valid == all(proof.valid for proof in of_all_pairs(q, 1e-4).values())
