"""Covers of all links: equal links share a shape and one fit."""

import numpy as np
import pytest

from mmp_env.importing import link_covers
from mmp_env.importing.cover_fit import COARSE_EFFORT, CoverError, coarse_covers, fit_coarse_cover
from mmp_env.importing.link_covers import fine_covers, link_shapes
from mmp_env.importing.pieces import Piece


def capsule(length):
    return Piece(vertices=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length]]), radius=0.05)


@pytest.fixture
def shapes():
    return link_shapes([(capsule(0.2),), (), (capsule(0.3),), (capsule(0.2),)])


def test_equal_links_share_a_shape(shapes):
    assert shapes[0] is shapes[3]
    assert shapes[1] is None
    assert shapes[2] is not shapes[0]


def test_equal_links_are_fitted_once(shapes, monkeypatch):
    fitted, fit = [], link_covers.fit_cover
    monkeypatch.setattr(link_covers, "fit_cover", lambda shape, *a, **k: fitted.append(shape) or fit(shape, *a, **k))
    covers = fine_covers("abcd", shapes, lambda line: None, 0.01, COARSE_EFFORT)
    assert fitted == [shapes[0], shapes[2]]
    assert covers[0] is covers[3]
    assert covers[1] is None


def test_a_link_without_a_cover_is_named(shapes, monkeypatch):
    def fails(*_args, **_options):
        raise CoverError("gaps remain")

    monkeypatch.setattr(link_covers, "fit_cover", fails)
    with pytest.raises(CoverError, match="link 'a': gaps remain"):
        fine_covers("abcd", shapes, lambda line: None, 0.01, COARSE_EFFORT)


def test_a_fit_that_remembers_gives_the_same_coarse_covers(shapes):
    known = {}

    def fit(shape, allowed):
        if (shape, allowed) not in known:
            known[shape, allowed] = fit_coarse_cover(shape, allowed)
        return known[shape, allowed]

    for cover, other in zip(coarse_covers(shapes, 12), coarse_covers(shapes, 12, fit), strict=True):
        assert (cover is None) == (other is None)
        if cover is not None and other is not None:
            np.testing.assert_array_equal(cover.centers, other.centers)
            np.testing.assert_array_equal(cover.radii, other.radii)
