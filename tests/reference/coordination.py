"""Coordination diagram of two paths. A state is the number of steps that each arm has done; all are tested."""

import itertools

import numpy as np

from reference.clearance import cloud, least_gap
from reference.motion import along


def gaps_of_paths(cell, arm_a, rows_a, arm_b, rows_b, samples):
    """Clearances [m] of the moving links, [a, b]: each arm at its steps and at `samples` - 1 instants between two."""
    a, b = (
        [cloud(cell, cell.arm(arm), q).moving for q in sampled(rows, samples)]
        for arm, rows in ((arm_a, rows_a), (arm_b, rows_b))
    )
    return np.array([[least_gap(mine, theirs) for theirs in b] for mine in a])


def sampled(rows, samples):
    """Returns the rows [k, dof] and interpolated rows between them."""
    steps = itertools.pairwise(rows)
    return [rows[0], *(q for here, there in steps for q in along(here, there, samples)[1:])]


def both_can_arrive(gaps, samples, required):
    """Returns whether both arms can reach their ends `required` [m] apart. In each move one or both do a step."""
    free = gaps >= required
    count_a, count_b = ((n - 1) // samples + 1 for n in gaps.shape)
    reached = np.zeros((count_a, count_b), dtype=bool)
    reached[0, 0] = free[0, 0]
    instants = np.arange(samples + 1)
    for s, t in np.ndindex(count_a, count_b):
        for on_a, on_b in ((1, 1), (1, 0), (0, 1)):
            if on_a <= s and on_b <= t and reached[s - on_a, t - on_b]:
                clear = free[(s - on_a) * samples + on_a * instants, (t - on_b) * samples + on_b * instants]
                reached[s, t] |= clear.all()
    return bool(reached[-1, -1])
