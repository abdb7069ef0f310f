"""Distances of two convex hulls beside an independent solver: bounds hold, agree, and are the same on all levels."""

import itertools

import numpy as np
import pytest
from reference.convex import distance_from_hull_to_origin, swept_vertices
from scipy.spatial.transform import Rotation

from mmp_env import core

ROUNDING_M, CONVERGED_M = 2e-12, 1e-8
SOLVER_ERROR_M = 1e-9
"""Largest error of the independent solver: it squares lengths."""
AT_ORIGIN = np.eye(4)[:3].ravel()
CUBE = np.array(list(itertools.product((-0.1, 0.1), repeat=3)))

SHAPES = {
    "point": np.zeros((1, 3)),
    "segment": np.array([[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0]]),
    "triangle": np.array([[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.3, 0.0]]),
    "square": np.array(list(itertools.product((-0.1, 0.1), (-0.1, 0.1), (0.0,)))),
    "points on a line": np.linspace(-1, 1, 9)[:, None] * [0.1, 0.2, -0.1],
    "one point many times": np.full((12, 3), 0.05),
    "cube": CUBE,
    "needle": CUBE * [1.0, 1e-9, 1e-9],
    "plate": CUBE * [1.0, 1.0, 1e-9],
    "tiny cube": CUBE * 1e-8,
    "many points": np.random.default_rng(1).normal(size=(60, 3)) * [0.1, 0.05, 0.2],
    "cube with twins": np.vstack([CUBE, CUBE + 1e-9]),
}


def pose_rows(rng, distance):
    """Returns a random pose as 12 numbers, `distance` from the origin on average [m]."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    pose[:3, 3] = rng.normal(size=3) * distance / np.sqrt(3)
    return pose[:3].ravel()


def placed(vertices, rows):
    """Returns vertices in the world."""
    pose = rows.reshape(3, 4)
    return vertices @ pose[:, :3].T + pose[:, 3]


def distances(a, b, poses, **radii):
    """Returns lower and upper bounds [n] [m]."""
    return core.hull_distances(a=a, b=b, poses=np.asarray(poses), **radii).T


def differences(a, b):
    """Returns all differences of two sets of points."""
    return (a[:, None] - b[None]).reshape(-1, 3)


@pytest.mark.parametrize(("first", "second"), list(itertools.combinations_with_replacement(SHAPES, 2)))
def test_bounds_enclose_the_distance_of_an_independent_solver(first, second):
    rng = np.random.default_rng(2)
    a, b = SHAPES[first], SHAPES[second]
    poses = np.array([[pose_rows(rng, 0.3), pose_rows(rng, 0.3)] for _ in range(12)])
    expected = np.array([distance_from_hull_to_origin(differences(placed(a, pa), placed(b, pb))) for pa, pb in poses])
    lower, upper = distances(a, b, poses)
    assert (lower <= expected + SOLVER_ERROR_M).all()
    assert (upper >= expected - SOLVER_ERROR_M).all()
    apart = expected > 1e-6
    np.testing.assert_allclose(lower[apart], expected[apart], rtol=0, atol=CONVERGED_M)
    np.testing.assert_allclose(upper[apart], expected[apart], rtol=0, atol=CONVERGED_M)


@pytest.mark.parametrize("far", [0.0, 100.0])
@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-3, 1.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.05, -0.02), (0.2, 0.0), (0.2, 0.2), (0.15, 0.3)])
def test_lower_bounds_of_boxes_hold_to_rounding_near_and_far_from_the_origin(far, gap, shift):
    """Two cubes of 0.2 m with parallel sides: faces, edges and corners are nearest."""
    across = [max(0.0, abs(s) - 0.2) for s in shift]
    a, b = AT_ORIGIN.copy(), AT_ORIGIN.copy()
    a[[3, 7, 11]] = far
    b[[3, 7, 11]] = far + 0.2 + gap, far + shift[0], far + shift[1]
    between = b - a
    exact_gap = np.linalg.norm([*across, between[3] - 0.2])
    lower, upper = distances(CUBE, CUBE, [[a, b]])
    assert lower <= exact_gap + ROUNDING_M
    assert upper >= exact_gap - CONVERGED_M
    if gap > CONVERGED_M:
        assert lower >= exact_gap - CONVERGED_M


@pytest.mark.parametrize("depth", [0.0, 1e-12, 1e-9, 0.05, 0.2])
def test_hulls_that_touch_or_overlap_have_no_positive_lower_bound(depth):
    rng = np.random.default_rng(3)
    for name in ("cube", "cube with twins", "plate", "square"):
        hull = SHAPES[name]
        offset = np.array([np.ptp(hull[:, 0]) - depth, 0.0, 0.0])
        turned = pose_rows(rng, 0.0)
        beside = turned.copy()
        beside[[3, 7, 11]] = placed(offset, turned)
        lower, upper = distances(hull, hull, [[turned, beside]])
        assert lower <= ROUNDING_M
        assert upper <= CONVERGED_M


def test_balls_are_taken_off_both_bounds():
    pose = AT_ORIGIN.copy()
    pose[3] = 1.0
    lower, upper = distances(CUBE, SHAPES["point"], [[AT_ORIGIN, pose]], radius_a=0.2, radius_b=0.3)
    np.testing.assert_allclose([lower[0], upper[0]], 0.4, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("cube", "many points"),
        ("segment", "segment"),
        ("plate", "triangle"),
        ("point", "needle"),
        ("many points", "many points"),
    ],
)
def test_swept_bounds_hold_at_every_instant_of_a_straight_motion(first, second):
    """Dense samples bound the distance from above; the hull of both ends gives it exactly, and from below."""
    rng = np.random.default_rng(4)
    a, b = SHAPES[first], SHAPES[second]
    poses = []
    for _ in range(40):
        start = [pose_rows(rng, 0.25), pose_rows(rng, 0.25)]
        step = Rotation.from_rotvec(rng.normal(size=3) * 0.1).as_matrix()
        end = [
            np.hstack([step @ p.reshape(3, 4)[:, :3], p.reshape(3, 4)[:, 3:] + rng.normal(size=(3, 1)) * 0.03]).ravel()
            for p in start
        ]
        poses.append([*start, *end])
    lower, upper = distances(a, b, poses)
    positive = 0
    for low, high, (a0, b0, a1, b1) in zip(lower, upper, poses, strict=True):
        sampled = [
            distance_from_hull_to_origin(differences(*swept_vertices((a, b), ((a0, b0), (a1, b1)), t, placed)))
            for t in np.linspace(0, 1, 17)
        ]
        ends = [differences(placed(a, pa), placed(b, pb)) for pa, pb in ((a0, b0), (a1, b1))]
        expected = distance_from_hull_to_origin(np.vstack(ends))
        assert low <= min(sampled) + SOLVER_ERROR_M
        assert low <= expected + SOLVER_ERROR_M
        if expected > 1e-6:
            np.testing.assert_allclose([low, high], expected, rtol=0, atol=CONVERGED_M)
            positive += 1
    assert positive > 5


def test_a_hull_that_does_not_move_has_its_distance_as_swept_bound():
    rng = np.random.default_rng(5)
    still = np.array([[pose_rows(rng, 0.4), pose_rows(rng, 0.4)] for _ in range(50)])
    plain = core.hull_distances(a=CUBE, b=SHAPES["many points"], poses=still)
    swept = core.hull_distances(a=CUBE, b=SHAPES["many points"], poses=np.concatenate([still, still], axis=1))
    np.testing.assert_array_equal(plain, swept)


def test_all_variants_give_the_same_bits():
    rng = np.random.default_rng(6)
    poses = np.array([[pose_rows(rng, 0.3) for _ in range(4)] for _ in range(60)])
    for first, second in itertools.combinations_with_replacement(SHAPES, 2):
        for count in (2, 4):
            asked = {"a": SHAPES[first], "b": SHAPES[second], "poses": np.ascontiguousarray(poses[:, :count])}
            results = [core.load_variant(name).hull_distances(**asked) for name in core.usable_variants()]
            for found in results[1:]:
                np.testing.assert_array_equal(found, results[0])
