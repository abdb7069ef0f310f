"""The broad phase of the checker leaves out only pairs that are far apart, and changes no report."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mmp_env import draw_problem, find_cell
from mmp_env.check import sweep
from mmp_env.check.boxes import near_boxes, ranges
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import part_pairs
from mmp_env.check.reading import read_cell
from mmp_env.check.spheres import SpherePairs, SphereSolids
from mmp_env.check.sweep import prove_apart
from mmp_env.check.trajectory import PlacedTrajectory, Trajectory
from mmp_env.files.cell_file import cell_to_dict

MODEL = CellModel(read_cell(cell_to_dict(find_cell("line-12"))))
PARTS, CLOUDS = sphere_parts(MODEL)
FAMILIES = [
    *(SpherePairs(MODEL, PARTS, CLOUDS, pairs) for pairs in part_pairs(MODEL.cell, PARTS).by_rule),
    SphereSolids(MODEL, PARTS, CLOUDS),
]
RULES = [family.rule for family in FAMILIES]
START = np.concatenate(list(draw_problem(find_cell("line-12"), seed=0).start.values()))


class AllPairs:
    """A family that leaves nothing out."""

    def __init__(self, family):
        self._family, self.rule = family, family.rule
        self.narrow, self.names = family.narrow, family.names

    def __len__(self):
        return len(self._family)

    def coarse(self, poses, steps, cutoff):
        return self._family.coarse(poses, steps, np.inf)


def trajectory(seed, length):
    """Returns a motion of all arms through four samples."""
    steps = length * np.random.default_rng(seed).uniform(-1.0, 1.0, (3, len(START)))
    return Trajectory(np.arange(4.0), np.vstack([START, START + np.cumsum(steps, axis=0)]))


@pytest.mark.parametrize("cutoff", [0.0, 0.01, 0.2, 2.0])
@pytest.mark.parametrize("family", FAMILIES, ids=RULES)
@settings(max_examples=5)
@given(seed=st.integers(0, 2**32), length=st.sampled_from([0.0, 0.3, 3.0]))
def test_pairs_that_are_left_out_keep_the_cutoff(family, cutoff, seed, length):
    path = trajectory(seed, length)
    track = PlacedTrajectory(MODEL, path, path.grid())
    every, bounds = family.coarse(track.poses, track.steps, np.inf)
    some, lower = family.coarse(track.poses, track.steps, cutoff)
    near = bounds < cutoff
    assert (some.step == every.step[near]).all()
    assert (some.pair == every.pair[near]).all()
    assert lower == pytest.approx(bounds[near], abs=1e-12)


@pytest.mark.parametrize("steps", [1, 7, 400_000])
@pytest.mark.parametrize("length", [0.0, 0.05, 0.3])
def test_the_proof_is_that_of_all_pairs(monkeypatch, length, steps):
    monkeypatch.setattr(sweep, "_BLOCK", 1)
    monkeypatch.setattr(sweep, "_FEWEST_STEPS", steps)
    required = dict.fromkeys(RULES, 0.0005)
    for seed in range(3):
        found, expected = (
            prove_apart(MODEL, families, trajectory(seed, length), required)
            for families in (FAMILIES, [AllPairs(family) for family in FAMILIES])
        )
        assert found.instants == expected.instants
        assert found.shortfalls == expected.shortfalls
        for rule in RULES:
            assert found.clearances[rule] == expected.clearances[rule]


@given(seed=st.integers(0, 2**32), count=st.integers(1, 30), gap=st.sampled_from([0.0, 0.05, 0.5, np.inf]))
def test_the_sweep_finds_all_boxes_that_are_near(seed, count, gap):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0.0, 1.0, (count, 3)) * rng.uniform(0.1, 5.0, 3)
    high = low + rng.uniform(0.0, 0.5, (count, 3))
    first, second = near_boxes(low, high, gap)
    expected = {
        (i, j)
        for i, j in combinations(range(count), 2)
        if max((low[j] - high[i]).max(), (low[i] - high[j]).max()) < gap
    }
    assert len(first) == len(expected)
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == expected


def test_a_box_that_is_not_finite_is_near_all_others():
    low = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    assert len(near_boxes(low, low + 1.0, 0.1)[0]) == 3


def test_ranges_may_be_empty():
    assert ranges(np.array([3, 5, 0]), np.array([5, 5, 2])).tolist() == [3, 4, 0, 1]
