"""Balls near points, found in groups, are those that a comparison of all points with all balls finds."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from mmp_env.importing.ball_search import deepest_ball, points_in_balls


def points_and_balls(seed, points, balls):
    random = np.random.default_rng(seed)
    return random.normal(size=(points, 3)), random.normal(size=(balls, 3)), random.uniform(0.01, 0.8, balls)


def outside(points, centers, radii):
    return np.linalg.norm(points[:, None] - centers, axis=2) - radii


@given(seed=st.integers(0, 10**6), points=st.sampled_from([1, 65, 3000]), balls=st.sampled_from([1, 40, 500]))
@settings(max_examples=20)
def test_the_deepest_ball_is_that_of_a_full_comparison(seed, points, balls):
    drawn, centers, radii = points_and_balls(seed, points, balls)
    every = outside(drawn, centers, radii)
    ball, away = deepest_ball(drawn, centers, radii)
    np.testing.assert_allclose(away, every.min(axis=1), rtol=0, atol=1e-12)
    np.testing.assert_allclose(every[np.arange(points), ball], every.min(axis=1), rtol=0, atol=1e-12)


@given(seed=st.integers(0, 10**6), points=st.sampled_from([1, 65, 3000]), balls=st.sampled_from([1, 40, 500]))
@settings(max_examples=20)
def test_points_in_balls_are_those_of_a_full_comparison(seed, points, balls):
    drawn, centers, radii = points_and_balls(seed, points, balls)
    depth = np.random.default_rng(seed).uniform(-0.05, 0.2, points)
    found = points_in_balls(drawn, depth, centers, radii)
    np.testing.assert_array_equal(found, np.nonzero(outside(drawn, centers, radii) + depth[:, None] <= 0))


@pytest.mark.parametrize(("points", "balls"), [(0, 3), (3, 0), (0, 0)])
def test_no_points_or_no_balls_find_nothing(points, balls):
    drawn, centers, radii = points_and_balls(0, points, balls)
    rows, columns = points_in_balls(drawn, np.zeros(points), centers, radii)
    assert len(rows) == len(columns) == 0


def test_equal_points_end_the_halving():
    ball, away = deepest_ball(np.zeros((5000, 3)), np.zeros((500, 3)), np.full(500, 0.1))
    assert len(ball) == 5000
    np.testing.assert_allclose(away, -0.1)
