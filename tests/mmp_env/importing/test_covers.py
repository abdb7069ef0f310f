"""Convex pieces contain their geoms, and sphere covers contain the pieces: by proof and by sampling."""

import functools

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from support.small_arms import box_mesh

from mmp_env.errors import MmpError
from mmp_env.importing import cover_fit, cover_proof
from mmp_env.importing.cover_fit import COARSE_EFFORT, CoverError, coarse_covers, fit_cover
from mmp_env.importing.cover_proof import Gaps, protrusion, prove_cover
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import HULL_TOLERANCE_M, Piece, mesh_piece
from mmp_env.meshes.decomposition import decomposed, is_far_from_convex
from mmp_env.meshes.polytope import polytope

BOX = Piece(vertices=box_mesh((0.06, 0.05, 0.04))[0])
CAPSULE = Piece(vertices=np.array([[0.0, 0, 0], [0, 0, 0.2]]), radius=0.04)
BALL = Piece(vertices=np.array([[0.02, 0, 0]]), radius=0.05)
OVERLAPPING = [BOX, BALL]


def cloud(seed, count):
    """Points in an ellipsoid, on its surface in part: a convex hull with many vertices."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * random.uniform(0.9, 1, (count, 1)) * random.uniform(0.02, 0.15, 3)


def support(points, directions):
    return (directions @ points.T).max(axis=1)


def surface_points(shape, count):
    random = np.random.default_rng(5)
    chosen = random.choice(len(shape.areas), count, p=shape.areas / shape.areas.sum())
    return np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), count), shape.triangles[chosen])


def outside(points, centers, radii):
    return np.min(np.linalg.norm(points[:, None] - centers, axis=2) - radii, axis=1)


@given(seed=st.integers(0, 10**6), count=st.sampled_from([6, 30, 60, 400]))
@settings(max_examples=25)
def test_a_mesh_piece_contains_its_points_and_is_hardly_larger(seed, count):
    points = cloud(seed, count)
    piece = mesh_piece(points)
    assert piece.radius <= HULL_TOLERANCE_M + 3e-6
    hull = polytope(piece.vertices)
    directions = np.concatenate([np.random.default_rng(0).normal(size=(300, 3)), hull.planes[:, :3]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    beyond = support(points, directions) - support(piece.vertices, directions) - piece.radius
    assert beyond.max() <= 0
    assert beyond.min() >= -2 * HULL_TOLERANCE_M


def round_surface(piece):
    """Points on a ball or a capsule."""
    directions = np.random.default_rng(1).normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ends = piece.vertices[
        (directions @ (piece.vertices[-1] - piece.vertices[0]) > 0).astype(int) * (len(piece.vertices) - 1)
    ]
    return ends + piece.radius * directions


@functools.cache
def box_and_cover():
    shape = LinkShape([BOX])
    return shape, fit_cover(shape, 0.008)


def test_points_in_a_plane_are_no_piece():
    with pytest.raises(MmpError, match="lie in a plane"):
        mesh_piece(np.random.default_rng(0).normal(size=(50, 3)) * [1, 1, 0])


@pytest.mark.parametrize("pieces", [[BOX], [CAPSULE], [BALL], OVERLAPPING], ids=["box", "capsule", "ball", "both"])
@pytest.mark.parametrize("allowed", [0.006, 0.02])
def test_a_fitted_cover_contains_the_shape_and_protrudes_as_little_as_asked_for(pieces, allowed):
    shape = LinkShape(pieces)
    cover = fit_cover(shape, allowed)
    assert cover.protrusion <= allowed
    assert len(prove_cover(shape, cover.centers, cover.radii).points) == 0
    flat = [surface_points(LinkShape([piece]), 5000) for piece in pieces if piece.radius == 0]
    points = np.concatenate(flat + [round_surface(piece) for piece in pieces if piece.radius > 0])
    hidden = np.zeros(len(points), bool)
    if len(pieces) > 1:  # the surface of one piece inside the other is no surface of the link
        hidden = (shape.depth(points, skip=0) > 1e-6) | (shape.depth(points, skip=1) > 1e-6)
    assert outside(points, cover.centers, cover.radii)[~hidden].max() <= 1e-9


@pytest.mark.parametrize("seed", [2, 3])
def test_a_thin_shell_with_a_radius_is_covered_by_spheres_with_centres_inside(seed):
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    shape = LinkShape([Piece(vertices=box_mesh((0.08, 0.06, 1e-4))[0] @ turn, radius=0.0004)])
    assert fit_cover(shape, 0.005, seed=seed).protrusion <= 0.005


def test_a_capsule_needs_fewer_spheres_than_a_box():
    assert len(fit_cover(LinkShape([CAPSULE]), 0.005).radii) < 12
    assert len(fit_cover(LinkShape([BALL]), 0.005).radii) == 1


def test_a_proof_that_ends_early_and_makes_no_progress_is_given_up(monkeypatch):
    shape, proofs = LinkShape((Piece(vertices=np.array([[0, 0, 0], [0, 0, 2.0]]), radius=0.035),)), []

    def noted(*args):
        proofs.append(prove_cover(*args))
        return proofs[-1]

    monkeypatch.setattr(cover_fit, "prove_cover", noted)
    monkeypatch.setattr(cover_proof, "_MOST_PARTS", 20_000)
    with pytest.raises(CoverError, match="too large, or has too many details"):
        fit_cover(shape, 0.02, effort=COARSE_EFFORT)
    assert all(gaps.budget_spent for gaps in proofs)
    assert len(proofs) < 10


def test_a_fit_goes_on_while_proofs_that_end_early_leave_smaller_gaps(monkeypatch):
    """The proofs of the first two rounds leave half of the gaps each, and the third one is complete."""
    shape, proofs = LinkShape((Piece(vertices=np.array([[0, 0, 0], [0, 0, 0.4]]), radius=0.035),)), []

    def early(*args):
        proofs.append(prove_cover(*args))
        point = np.array([[0.0, 0.035, 0.2]])
        area = 0.01 * 0.5 ** len(proofs)
        return (
            Gaps(points=point, outside=np.array([1e-4]), area=area, budget_spent=True)
            if len(proofs) < 4
            else proofs[-1]
        )

    monkeypatch.setattr(cover_fit, "prove_cover", early)
    cover = fit_cover(shape, 0.02, effort=COARSE_EFFORT)
    assert len(proofs) >= 4
    assert not len(prove_cover(shape, cover.centers, cover.radii).points)


def test_the_same_shape_gives_the_same_cover():
    first, second = fit_cover(LinkShape([BOX]), 0.008), box_and_cover()[1]
    np.testing.assert_array_equal(first.centers, second.centers)
    np.testing.assert_array_equal(first.radii, second.radii)


def test_a_ball_around_a_box_is_a_proved_cover_and_a_smaller_one_is_not():
    shape, radius = LinkShape([BOX]), np.linalg.norm([0.03, 0.025, 0.02])
    center = np.zeros((1, 3))
    assert prove_cover(shape, center, np.array([radius + 1e-6])).uncovered_mm == 0
    gaps = prove_cover(shape, center, np.array([radius - 1e-3]))
    assert 0.5 <= gaps.uncovered_mm <= 1.1
    assert protrusion(shape, center, np.array([radius])) == pytest.approx(radius - 0.02)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=10)
def test_a_needed_sphere_that_is_missing_or_smaller_leaves_a_gap(seed):
    random = np.random.default_rng(seed)
    shape, cover = box_and_cover()
    points = surface_points(shape, 4000)
    k = int(random.integers(len(cover.radii)))
    radii = cover.radii.copy()
    radii[k] *= random.choice([0.0, 0.5, 0.8])
    missed = outside(points, cover.centers, radii).max()
    gaps = prove_cover(shape, cover.centers, radii)
    assert missed <= 0 or gaps.uncovered_mm > 0


def test_a_piece_with_a_radius_is_covered_with_its_radius():
    thin, thick = Piece(vertices=BOX.vertices), Piece(vertices=BOX.vertices, radius=0.002)
    cover = fit_cover(LinkShape([thin]), 0.02)
    gaps = prove_cover(LinkShape([thick]), cover.centers, cover.radii)
    assert gaps.uncovered_mm > 0
    thick_cover = fit_cover(LinkShape([thick]), 0.02)
    assert len(prove_cover(LinkShape([thick]), thick_cover.centers, thick_cover.radii).points) == 0


def test_a_coarse_set_keeps_its_budget_on_the_links_that_move():
    covers = coarse_covers([LinkShape([BOX]), LinkShape([CAPSULE]), None, LinkShape([BOX])], 20)
    assert covers[2] is None
    assert sum(len(cover.radii) for cover in covers[1:] if cover) <= 20
    assert max(cover.protrusion for cover in covers if cover) < 0.03


def l_mesh():
    """A closed mesh of two plates at a right angle, which is far from its hull."""
    first = [[0, 0], [0.4, 0], [0.4, 0.03], [0.03, 0.03], [0.03, 0.4], [0, 0.4]]
    vertices = np.array([[x, y, z] for z in (0, 0.1) for x, y in first])
    faces = [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 5, 4]]
    faces += [[a + 6, c + 6, b + 6] for a, b, c in faces]
    for k in range(6):
        n = (k + 1) % 6
        faces += [[k, n, n + 6], [k, n + 6, k + 6]]
    return vertices, np.array(faces)


def test_a_mesh_far_from_its_hull_becomes_pieces_that_contain_it():
    pytest.importorskip("coacd", reason="coacd is not installed")
    vertices, faces = l_mesh()
    assert is_far_from_convex(vertices, faces)
    assert not is_far_from_convex(*box_mesh((0.4, 0.4, 0.1)))
    pieces = [mesh_piece(points) for points in decomposed(vertices, faces)]
    assert len(pieces) >= 2
    shape = LinkShape(pieces)
    assert shape.volume < 0.5 * polytope(vertices).volume
    random = np.random.default_rng(0)
    points = np.einsum(
        "nk,nkd->nd", random.dirichlet(np.ones(3), 5000), vertices[faces][random.integers(len(faces), size=5000)]
    )
    assert shape.depth(points).min() >= -1e-9


def test_too_little_memory_is_not_called_a_flat_piece(monkeypatch):
    def no_memory(_):
        raise spatial.QhullError("QH6080 qhull error (qh_memalloc): insufficient memory to allocate 80 bytes")

    spatial = pytest.importorskip("scipy.spatial")
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert polytope(corners) is not None
    with pytest.raises(MmpError, match="in a plane"):
        polytope(corners[:, [0, 1, 1]])
    monkeypatch.setattr(spatial, "ConvexHull", no_memory)
    with pytest.raises(MemoryError):
        polytope(corners)
