"""Coordination diagrams of the core against the reference, which tests every state by samples."""

import numpy as np
import pytest
from reference import clearance, coordination
from support.two_arms import along

from mmp_env import core, draw_instance, ring_cell

STEP_RAD, MARGIN_M, MORE_M, SAMPLES = 0.1, 0.02, 0.03, 3


@pytest.mark.parametrize("seed", range(3, 13))
def test_two_arms_on_random_paths_can_arrive_where_the_reference_says_so(seed):
    cell, rng = ring_cell(2), np.random.default_rng(seed)
    start, goal = draw_instance(cell, seed=seed)
    vias = {name: (start[name] + goal[name]) / 2 + rng.uniform(-0.5, 0.5, 6) for name in cell.arm_names}
    paths = [along(STEP_RAD, start[name], vias[name], goal[name]) for name in cell.arm_names]
    proof = 0.6 * MARGIN_M
    both = core.PathRecombination(cell.collision.core, [np.full(6, STEP_RAD)] * 2, core.Levels(MARGIN_M, proof))
    numbers = both.add(paths)
    closed = both.infeasible_pairs(numbers, core.Clock(float("inf")))
    found = both.recombine(float("inf"), core.Clock(float("inf")))
    (a, b), (rows_a, rows_b) = cell.arm_names, paths
    gaps = coordination.gaps_of_paths(cell, a, rows_a, b, rows_b, SAMPLES)
    assert closed == ([(0, 1)] if found is None else [])
    if found is None:
        assert not coordination.both_can_arrive(gaps, SAMPLES, MARGIN_M + MORE_M)
    else:
        assert coordination.both_can_arrive(gaps, SAMPLES, proof - 1e-5)
        assert clearance.clearance_of_motions(cell, a, found[0], b, found[1]) >= proof - 1e-5
