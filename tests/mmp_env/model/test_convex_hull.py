"""Planes around convex hulls, compared with Qhull."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env.model.convex_hull import plane_distance, supporting_planes, thickness


@pytest.mark.parametrize("kind", ["round", "box", "flat"])
@pytest.mark.parametrize("seed", range(5))
def test_planes_hold_every_face_and_cut_no_vertex(kind: str, seed: int) -> None:
    spatial = pytest.importorskip("scipy.spatial")
    random = np.random.default_rng(seed)
    points = random.normal(size=(60, 3)) * [1.0, 0.3, 0.001 if kind == "flat" else 0.5]
    points = np.clip(points, -0.2, 0.2).round(1) + 5 if kind == "box" else points
    planes = supporting_planes(points)
    assert plane_distance(planes, points).max() <= 1e-12
    faces = spatial.ConvexHull(points).equations
    there = random.normal(size=(500, 3)) * 3 + points.mean(axis=0)
    by_faces = (there @ faces[:, :3].T + faces[:, 3]).max(axis=1)
    assert (plane_distance(planes, there) >= by_faces - 1e-9).all()


def test_a_plane_beside_a_sharp_corner_measures_from_the_corner() -> None:
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    away = np.array([[2.0, 2.0, 2.0], [2.0, 2.0, 0.5]])
    assert plane_distance(supporting_planes(cube), away) == pytest.approx([3**0.5, 2**0.5])


def test_points_in_a_plane_have_no_planes_and_no_thickness() -> None:
    flat = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1.0]])
    assert len(supporting_planes(flat)) == 0
    assert thickness(flat) == pytest.approx(0.0, abs=1e-12)
