"""The distance reference against values known by hand, and against points sampled on the surfaces."""

import numpy as np
import pytest
from reference import distance, toys


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ([2.0, 0, 0], 1.5),
        ([0.5 + 3, 1 + 4, 0], 5.0),
        ([0.5 + 1, 1 + 2, 1.5 + 2], 3.0),
        ([0, 0, 0], -0.5),
        ([0, 0.9, 0], -0.1),
        ([0.5, 1, 1.5], 0.0),
    ],
)
def test_a_box_of_1_by_2_by_3(point, expected):
    assert distance.to_box(np.array(point), [1, 2, 3]) == pytest.approx(expected)


@pytest.mark.parametrize(("point", "expected"), [([0, 3.0, 4.0], 4.0), ([0, 0, 0], -1.0), ([0.6, 0.8, 0], 0.0)])
def test_a_sphere_of_radius_1(point, expected):
    assert distance.to_sphere(np.array(point), 1.0) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ([3.0, 0, 0], 2.0),
        ([0, 0, 5.0], 3.0),
        ([0, 4.0, 6.0], 5.0),
        ([0, 0, 0], -1.0),
        ([0, 0, 1.75], -0.25),
        ([0.9, 0, 0], -0.1),
    ],
)
def test_a_cylinder_of_radius_1_and_length_4(point, expected):
    assert distance.to_cylinder(np.array(point), 1.0, 4.0) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("point", "expected"),
    [([3.0, 0, 0], 2.0), ([0, 0, 5.0], 2.0), ([3.0, 0, 6.0], 4.0), ([0, 0, 0], -1.0), ([0, 0, 2.5], -0.5)],
)
def test_a_capsule_of_radius_1_and_length_4_without_its_caps(point, expected):
    assert distance.to_capsule(np.array(point), 1.0, 4.0) == pytest.approx(expected)


def test_an_obstacle_is_turned_and_moved_into_its_place():
    quarter_about_y = (np.sqrt(0.5), 0, np.sqrt(0.5), 0)  # turns z to x
    lying = toys.solid("cylinder", [1, 2, 3], quarter_about_y, radius=0.5, length=4.0)
    assert distance.to_obstacle([4.0, 2, 3], lying) == pytest.approx(1.0)
    assert distance.to_obstacle([1.0, 2, 5], lying) == pytest.approx(1.5)


def boxes(rng, count):
    size = np.array([0.3, 0.5, 0.8])
    points = rng.uniform(-size / 2, size / 2, (count, 3))
    side = rng.integers(3, size=count)
    rows = np.arange(count)
    points[rows, side] = np.sign(points[rows, side]) * size[side] / 2
    return toys.solid("box", [0, 0, 0], size=size), points


def spheres(rng, count):
    points = rng.normal(size=(count, 3))
    return toys.solid("sphere", [0, 0, 0], radius=0.4), 0.4 * points / np.linalg.norm(points, axis=1)[:, None]


def cylinders(rng, count):
    angle, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-0.4, 0.4, count)
    aside = np.full(count, 0.3)
    caps = rng.random(count) < 0.4
    aside[caps] = 0.3 * np.sqrt(rng.random(caps.sum()))
    height[caps] = 0.4 * np.sign(height[caps])
    points = np.stack([aside * np.cos(angle), aside * np.sin(angle), height], axis=1)
    return toys.solid("cylinder", [0, 0, 0], radius=0.3, length=0.8), points


def capsules(rng, count):
    points = rng.normal(size=(count, 3))
    points = 0.2 * points / np.linalg.norm(points, axis=1)[:, None]
    wall = rng.random(count) < 0.5
    points[wall, :2] *= 0.2 / np.linalg.norm(points[wall, :2], axis=1)[:, None]
    points[:, 2] = np.where(wall, rng.uniform(-0.3, 0.3, count), points[:, 2] + 0.3 * np.sign(points[:, 2]))
    return toys.solid("capsule", [0, 0, 0], radius=0.2, length=0.6), points


@pytest.mark.parametrize("surface", [boxes, spheres, cylinders, capsules])
def test_the_size_of_the_distance_is_that_to_the_nearest_of_many_surface_points(surface):
    rng = np.random.default_rng(5)
    obstacle, points = surface(rng, 60_000)
    for _ in range(60):
        place = rng.uniform(-0.7, 0.7, 3)
        nearest = np.linalg.norm(points - place, axis=1).min()
        found = abs(distance.to_obstacle(place, obstacle))
        assert found <= nearest + 1e-12
        assert nearest <= found + 0.025  # the surface points lie about 5 mm apart


@pytest.mark.parametrize("surface", [boxes, spheres, cylinders, capsules])
def test_the_sign_changes_at_the_surface(surface):
    obstacle, points = surface(np.random.default_rng(6), 200)
    for point in points:
        assert distance.to_obstacle(point, obstacle) == pytest.approx(0, abs=1e-12)
        # These solids are convex and hold the origin.
        assert distance.to_obstacle(0.98 * point, obstacle) < 0 < distance.to_obstacle(1.02 * point, obstacle)
