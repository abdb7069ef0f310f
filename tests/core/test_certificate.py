"""The certificate of many arms, which looks at arms that come close, against certificates of every two arms."""

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


def certificate(arms, q, required_m):
    """Returns the certificate of some arms, to which the others do not exist."""
    cell = Cell(name="some", arms=tuple(CELL.arms[a] for a in arms), obstacles=CELL.obstacles)
    levels = core.Levels(margin=required_m, proof=required_m, obstacles=-1.0, own=-1.0)  # so that pairs decide
    return core.certify(cell.collision.core, [q[a] for a in arms], levels, 1.0, CLOCK)


def of_all_pairs(q, required_m):
    return {pair: certificate(pair, q, required_m) for pair in combinations(range(len(CELL.arms)), 2)}


@pytest.mark.parametrize("seed", range(4))
def test_the_sampled_clearance_is_the_least_of_all_pairs(seed):
    q = motion(seed, 0.3)
    found = certificate(range(len(CELL.arms)), q, FAR_M)
    pairs = of_all_pairs(q, FAR_M)
    assert not found.valid
    assert found.clearance == pytest.approx(min(proof.clearance for proof in pairs.values()), abs=1e-12)


@pytest.mark.parametrize("length", [0.02, 0.4, 0.8])
def test_a_plan_is_proved_if_every_pair_of_its_arms_is(length):
    for seed in range(6):
        q = motion(seed, length)
        found = certificate(range(len(CELL.arms)), q, 1e-4)
        pairs = of_all_pairs(q, 1e-4)
        assert found.valid == all(proof.valid for proof in pairs.values())
