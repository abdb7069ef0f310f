"""Seeds that follow from the seed of a run."""

import itertools

import pytest

from mmp_planners.seeds import quick_seed_of, seed_of, sub_seeds


@pytest.mark.parametrize("seed", [seed_of, quick_seed_of])
def test_each_key_has_a_seed_of_its_own_zeros_at_its_ends_included(seed):
    keys = [key for length in range(1, 5) for key in itertools.product((0, 1, 5), repeat=length)]
    seeds = {seed(*key) for key in keys}
    assert len(seeds) == len(keys)
    assert all(0 <= value < 2**64 for value in seeds)


def test_restarts_have_different_seeds_and_the_same_run_has_the_same_ones():
    first, again = (list(itertools.islice(sub_seeds(7), 20)) for _ in range(2))
    assert first == again
    assert len(set(first)) == 20
