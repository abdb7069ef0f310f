"""Balls near points, depths in half-spaces and small covers are those of slow comparisons of everything."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from reference.set_cover import small_cover

from mmp_env import core

COUNTS = {"points": st.sampled_from([1, 65, 3000]), "balls": st.sampled_from([1, 40, 500])}


def points_and_balls(seed, points, balls):
    random = np.random.default_rng(seed)
    return random.normal(size=(points, 3)), random.normal(size=(balls, 3)), random.uniform(0.01, 0.8, balls)


def outside(points, centers, radii):
    return np.linalg.norm(points[:, None] - centers, axis=2) - radii


def coverings(seed, samples, candidates):
    """Returns arguments of `small_cover`: samples on a circle, and candidates that cover arcs of it."""
    random = np.random.default_rng(seed)
    away = np.abs(random.random((samples, 1)) - random.random(candidates))
    rows, columns = np.nonzero(np.minimum(away, 1 - away) < random.uniform(0.01, 0.2, candidates))
    return {
        "samples": rows.astype(np.int32),
        "candidates": columns.astype(np.int32),
        "sample_count": samples,
        "candidate_count": candidates,
    }


@given(seed=st.integers(0, 10**6), **COUNTS)
@settings(max_examples=20)
def test_the_deepest_ball_is_that_of_a_full_comparison(seed, points, balls):
    drawn, centers, radii = points_and_balls(seed, points, balls)
    every = outside(drawn, centers, radii)
    ball, away = core.deepest_balls(drawn, centers, radii)
    np.testing.assert_allclose(away, every.min(axis=1), rtol=0, atol=1e-12)
    np.testing.assert_allclose(every[np.arange(points), ball], every.min(axis=1), rtol=0, atol=1e-12)


@given(seed=st.integers(0, 10**6), **COUNTS)
@settings(max_examples=20)
def test_points_in_balls_are_those_of_a_full_comparison(seed, points, balls):
    drawn, centers, radii = points_and_balls(seed, points, balls)
    depth = np.random.default_rng(seed).uniform(-0.05, 0.2, points)
    found = core.points_in_balls(drawn, depth, centers, radii)
    np.testing.assert_array_equal(found, np.nonzero(outside(drawn, centers, radii) + depth[:, None] <= 0))


@pytest.mark.parametrize(("points", "balls"), [(0, 3), (3, 0), (0, 0)])
def test_no_points_or_no_balls_find_nothing(points, balls):
    drawn, centers, radii = points_and_balls(0, points, balls)
    rows, columns = core.points_in_balls(drawn, np.zeros(points), centers, radii)
    assert len(rows) == len(columns) == 0
    assert (core.deepest_balls(drawn, centers, radii)[1] == np.inf).all()


def test_equal_points_end_the_halving():
    ball, away = core.deepest_balls(np.zeros((5000, 3)), np.zeros((500, 3)), np.full(500, 0.1))
    assert (ball == 0).all()
    np.testing.assert_allclose(away, -0.1)


@given(seed=st.integers(0, 10**6), points=st.sampled_from([0, 1, 7, 100]), planes=st.sampled_from([1, 5, 60]))
def test_depths_in_half_spaces_are_the_least_of_all_planes(seed, points, planes):
    random = np.random.default_rng(seed)
    drawn, normals = random.normal(size=(points, 3)), random.normal(size=(planes, 4))
    depth = core.plane_depths(drawn, normals)
    np.testing.assert_allclose(depth, (normals[:, 3] - drawn @ normals[:, :3].T).min(axis=1), rtol=0, atol=1e-12)


@given(seed=st.integers(0, 10**6), samples=st.sampled_from([1, 30, 400]), candidates=st.sampled_from([1, 25, 300]))
@settings(max_examples=30)
def test_a_small_cover_is_that_of_the_reference(seed, samples, candidates):
    random = np.random.default_rng(seed)
    given_ = coverings(seed, samples, candidates)
    given_ |= {
        "chosen": random.choice(candidates, candidates // 5, replace=False).astype(np.int32),
        "draws": random.random(80),
    }
    found = core.small_cover(**given_)
    np.testing.assert_array_equal(found, small_cover(**given_))
    covered = given_["samples"][np.isin(given_["candidates"], found)]
    assert set(covered.tolist()) == set(given_["samples"].tolist())


def test_a_search_makes_a_greedy_cover_smaller():
    given_ = coverings(3, 400, 300) | {"chosen": np.arange(100, dtype=np.int32)}
    greedy, searched = (core.small_cover(**given_, draws=np.random.default_rng(0).random(n)) for n in (0, 300))
    assert len(searched) < len(greedy)


def test_all_variants_find_the_same_balls_depths_and_covers():
    drawn, centers, radii = points_and_balls(5, 3000, 500)
    given_ = coverings(5, 400, 300) | {"chosen": np.empty(0, np.int32), "draws": np.random.default_rng(5).random(80)}
    planes = np.column_stack([centers, radii])
    found = [
        (
            *variant.deepest_balls(drawn, centers, radii),
            *variant.points_in_balls(drawn, np.zeros(3000), centers, radii),
            variant.plane_depths(drawn, planes),
            variant.small_cover(**given_),
        )
        for variant in map(core.load_variant, core.usable_variants())
    ]
    for arrays in found[1:]:
        for one, other in zip(found[0], arrays, strict=True):
            np.testing.assert_array_equal(one, other)
