"""Convex hulls of links decide where spheres come close: distances, conflicts, edges and constraints."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from reference.convex import distance_from_hull_to_origin, hull_distance
from reference.repulsion import sphere_force

from mmp_env import core
from mmp_env.model.convex_hull import supporting_planes

REACH_M = 1.0
UNKNOWN_M = 1e9


def chain(x=0.0):
    """Returns what `add_arm` takes, but spheres: two joints about z, the second 1 m from the first, the base at x."""
    base, elbow = np.eye(4), np.eye(4)
    base[0, 3], elbow[0, 3] = x, REACH_M
    return {
        "fixed": np.array([base[:3].ravel(), elbow[:3].ravel()]),
        "tool": np.eye(4)[:3].ravel(),
        "slides": np.zeros(2, dtype=bool),
        "lower": np.full(2, -np.pi),
        "upper": np.full(2, np.pi),
        "link_frames": np.array([0, 1, 2], dtype=np.int32),
        "self_pairs": np.zeros((0, 2), dtype=np.int32),
    }


def cell_of(*arms, protrusion=UNKNOWN_M, obstacles=(), hulls=True):
    """Returns a cell of arms (x, vertices, radius): a hull on the second link of each, in one sphere."""
    cell = core.Cell()
    for k, (x, vertices, radius) in enumerate(arms):
        bound = np.linalg.norm(vertices, axis=1).max() + radius
        spheres = np.array([[0, 0, 0, bound]])
        cell.add_arm(**chain(x), spheres=spheres, sphere_links=np.array([2], dtype=np.int32))
        if hulls:
            cell.add_hull(arm=k, link=2, vertices=vertices, radius=radius, protrusion=protrusion)
    for obstacle in obstacles:
        cell.add_obstacle(*obstacle)
    cell.freeze()
    return cell


def placed(vertices, x, q):
    """Returns the vertices in the world."""
    for angle, offset in ((q[1], REACH_M), (q[0], x)):
        c, s = np.cos(angle), np.sin(angle)
        vertices = vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [offset, 0, 0]
    return vertices


def drawn(rng, count, size=(0.3, 0.2, 0.1)):
    """Returns `count` points in a box; `size` has half its sides [m]."""
    return rng.uniform(-1, 1, (count, 3)) * size


def separated(a, b):
    """Returns whether some direction between the points separates them widely: then the hulls do not overlap."""
    d = b.mean(axis=0) - a.mean(axis=0)
    return (b @ d).min() - (a @ d).max() > 1e-3


@pytest.mark.parametrize(("counts", "radii"), [((9, 9), (0.0, 0.0)), ((1, 7), (0.02, 0.01)), ((2, 2), (0.05, 0.03))])
def test_clearances_are_distances_of_hulls(counts, radii):
    rng = np.random.default_rng(1)
    (a, b), x = (drawn(rng, n) for n in counts), 0.6
    cell = cell_of((0.0, a, radii[0]), (x, b, radii[1]))
    q = rng.uniform(-np.pi, np.pi, (2, 40, 2))
    apart = [separated(placed(a, 0.0, p), placed(b, x, r)) for p, r in zip(*q, strict=True)]
    q = q[:, apart]
    assert len(q[0]) > 10
    expected = [hull_distance(placed(a, 0.0, p), placed(b, x, r)) - sum(radii) for p, r in zip(*q, strict=True)]
    found = core.pair_clearance(cell, 0, q[0], 1, q[1], precise=True)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)
    assert (found <= np.array(expected) + 1e-11).all()  # a lower bound
    single = core.pair_clearance(cell, 0, q[0], 1, q[1], precise=False)
    np.testing.assert_allclose(single, expected, rtol=0, atol=1e-5)


def test_many_vertices_give_the_distance_of_their_hull():
    """The farthest vertex of a large hull is looked up by direction; those inside the hull add nothing."""
    rng = np.random.default_rng(2)
    a = drawn(rng, 8)
    inner = rng.dirichlet(np.ones(8), 300) @ a
    few, many = (cell_of((0.0, v, 0.0), (1.2, a, 0.0)) for v in (a, np.vstack([a, inner])))
    q = rng.uniform(-np.pi, np.pi, (2, 300, 2))
    clearances = [core.pair_clearance(cell, 0, q[0], 1, q[1], precise=True) for cell in (few, many)]
    apart = clearances[0] > 1e-6
    assert apart.sum() > 100
    np.testing.assert_allclose(clearances[1][apart], clearances[0][apart], rtol=0, atol=1e-8)


def test_hulls_that_overlap_have_no_positive_clearance():
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b = drawn(rng, 9), drawn(rng, 9)
        cell = cell_of((0.0, a, 0.0), (0.0, b, 0.0))
        q = np.repeat(rng.uniform(-1, 1, (1, 2)), 2, axis=0)  # both links in one place, around their common origin
        if (core.pair_clearance(cell, 0, q, 1, q, precise=True) > 0).any():
            assert hull_distance(a, b) > 0


SOLIDS = {
    "box": (0, [0.2, 0.1, 0.3], np.array(list(itertools.product((-0.2, 0.2), (-0.1, 0.1), (-0.3, 0.3)))), 0.0),
    "sphere": (1, [0.25, 0, 0], np.zeros((1, 3)), 0.25),
    "capsule": (3, [0.1, 0.2, 0], np.array([[0, 0, -0.2], [0, 0, 0.2]]), 0.1),
}


@pytest.mark.parametrize("solid", SOLIDS)
def test_obstacles_are_measured_exactly(solid):
    shape, size, corners, radius = SOLIDS[solid]
    rng = np.random.default_rng(4)
    pose = np.eye(4)
    pose[:3, 3] = [1.0, 0.9, 0.1]
    a = drawn(rng, 8)
    cell = cell_of((0.0, a, 0.01), obstacles=[(shape, pose[:3].ravel(), np.array(size, dtype=float))])
    q = rng.uniform(-np.pi, np.pi, (60, 2))
    q = q[[separated(placed(a, 0.0, p), corners + pose[:3, 3]) for p in q]]
    expected = np.array([hull_distance(placed(a, 0.0, p), corners + pose[:3, 3]) - radius - 0.01 for p in q])
    near, found = expected > 1e-6, core.static_clearance(cell, 0, q, precise=True)
    assert near.sum() > 20
    np.testing.assert_allclose(found[near], expected[near], rtol=0, atol=1e-8)


def test_a_cylinder_is_measured_along_its_round_side():
    a = np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    pose = np.eye(4)
    pose[:3, 3] = [2.0, 0, 0]
    cell = cell_of((0.0, a, 0.0), obstacles=[(2, pose[:3].ravel(), np.array([0.3, 0.2, 0.0]))])
    found = core.static_clearance(cell, 0, np.array([[0.0, 0.0], [0.0, np.pi / 2]]), precise=True)
    np.testing.assert_allclose(found, [0.6, np.hypot(1.0, 0.0) - 0.3], rtol=0, atol=1e-8)


def test_links_whose_spheres_overlap_pass_each_other_by_their_hulls():
    """Two long thin bars lie side by side; their spheres overlap by far."""
    bar = np.array([[-0.4, 0, 0], [0.4, 0, 0]])
    arms = ((0.0, bar, 0.02), (0.1, bar, 0.02))
    side = np.array([[np.pi / 2, -np.pi / 2 + np.pi / 2], [np.pi / 2 + 0.05, -0.05]])
    other = np.array([[np.pi / 2, 0.0], [np.pi / 2, 0.0]])
    for hulls, free in ((True, True), (False, False)):
        cell = cell_of(*arms, hulls=hulls)
        motions = [core.Motion(cell, k, rows) for k, rows in enumerate((side, other))]
        pairs = np.array([[0, 1]], dtype=np.int32)
        found = core.conflict_instants(cell, motions, pairs, core.Levels(0.002, 0.0015))[0]
        assert (len(found) == 0) == free


@pytest.mark.parametrize("size", [(0.3, 0.2, 0.1), (0.3, 0.02, 0.01), (0.01, 0.3, 0.02)])
@pytest.mark.parametrize("protrusion", [0.35, UNKNOWN_M])
def test_conflicts_are_those_of_dense_samples(protrusion, size):
    rng = np.random.default_rng(5)
    margin, steps, fine = 0.01, 12, 50
    conflicts = 0
    for _ in range(60):
        a, b = drawn(rng, 9, size), drawn(rng, 9, size)
        cell = cell_of((0.0, a, 0.01), (1.3, b, 0.0), protrusion=protrusion)
        ends = rng.uniform(-np.pi, np.pi, (2, 2, 2))
        rows = [np.linspace(*pair, steps) for pair in ends]
        dense = [np.linspace(*pair, (steps - 1) * fine + 1) for pair in ends]
        least = core.pair_clearance(cell, 0, dense[0], 1, dense[1], precise=True).min()
        motions = [core.Motion(cell, k, r) for k, r in enumerate(rows)]
        pairs = np.array([[0, 1]], dtype=np.int32)
        found = core.conflict_instants(cell, motions, pairs, core.Levels(margin, 0.5 * margin))[0]
        if len(found) == 0:
            assert least >= 0.5 * margin - 1e-5
        else:
            assert least < margin + 5e-3  # at an instant between samples
            conflicts += 1
    assert 5 < conflicts < 55


def test_free_edges_keep_the_proved_distance_from_obstacles():
    rng = np.random.default_rng(6)
    pose = np.eye(4)
    pose[:3, 3] = [1.0, 0.6, 0]
    box = (0, pose[:3].ravel(), np.array([0.3, 0.05, 0.2]))
    cell = cell_of((0.0, drawn(rng, 12), 0.01), obstacles=[box], protrusion=0.35)
    start, end = rng.uniform(-np.pi, np.pi, (2, 200, 2))
    free = core.edges_free(cell, 0, start, end, core.Levels(0.004, 0.002))
    least = np.array(
        [
            core.static_clearance(cell, 0, np.linspace(p, q, 400), precise=True).min()
            for p, q in zip(start, end, strict=True)
        ]
    )
    assert 20 < free.sum() < 180
    assert least[free].min() >= 0.002 - 1e-5
    assert free[least > 0.0045].all()


def test_a_standing_arm_with_smaller_spheres_forbids_nothing_while_hulls_are_apart():
    bar = np.array([[-0.4, 0, 0], [0.4, 0, 0]])
    cell = cell_of((0.0, bar, 0.02), (0.1, bar, 0.02))
    q = np.array([np.pi / 2, 0.0])
    standing = core.Constraint.standing(cell, 1, q, shrink=0.05, start=0.0, end=5.0)
    apart, through = core.Motion(cell, 0, q[None]), core.Motion(cell, 0, np.array([[np.pi / 2, np.pi / 2 - 0.2]]))
    assert not core.breaks_constraint(cell, apart, [standing], 0.002)
    assert core.breaks_constraint(cell, through, [standing], 0.002)


def test_convex_obstacles_are_measured_exactly():
    rng = np.random.default_rng(7)
    corners = np.array(list(itertools.product((0.9, 1.1), (0.8, 1.0), (-0.2, 0.2))))
    planes = np.array([[*n, max(corners @ n)] for n in (*np.eye(3), *-np.eye(3))])
    a = drawn(rng, 8)
    cell = core.Cell()
    spheres = np.array([[0, 0, 0, np.linalg.norm(a, axis=1).max()]])
    cell.add_arm(**chain(), spheres=spheres, sphere_links=np.array([2], dtype=np.int32))
    cell.add_hull(arm=0, link=2, vertices=a)
    cell.add_hull_obstacle(vertices=corners, planes=planes, radius=0.01)
    cell.freeze()
    q = rng.uniform(-np.pi, np.pi, (60, 2))
    q = q[[separated(placed(a, 0.0, p), corners) for p in q]]
    expected = np.array([hull_distance(placed(a, 0.0, p), corners) - 0.01 for p in q])
    found = core.static_clearance(cell, 0, q, precise=True)
    np.testing.assert_allclose(found[expected > 1e-6], expected[expected > 1e-6], rtol=0, atol=1e-8)


def test_links_beside_an_edge_of_a_convex_obstacle_are_not_taken_for_contacts():
    rng = np.random.default_rng(3)
    corners = np.array([[1.0, 0.9, -0.5], [1.0, 0.9, 0.5], [1.4, 0.88, -0.5], [1.4, 0.88, 0.5], [1.4, 0.92, 0.0]])
    planes = supporting_planes(corners)
    a = drawn(rng, 8)
    cell = core.Cell()
    bound = np.linalg.norm(a, axis=1).max()
    cell.add_arm(**chain(), spheres=np.array([[0, 0, 0, bound]]), sphere_links=np.array([2], dtype=np.int32))
    cell.add_hull(arm=0, link=2, vertices=a, protrusion=bound / 4)
    cell.add_hull_obstacle(vertices=corners, planes=planes)
    cell.freeze()
    q = rng.uniform(-np.pi, np.pi, (400, 2))
    clearance = core.static_clearance(cell, 0, q, precise=True)
    free = core.edges_free(cell, 0, q, q, core.Levels(1e-3, 5e-4))
    assert free[clearance > 0.0015].all()
    assert not free[clearance < 0].any()


def test_hulls_come_in_the_order_of_the_links():
    cell = core.Cell()
    cell.add_arm(**chain(), spheres=np.zeros((0, 4)), sphere_links=np.zeros(0, dtype=np.int32))
    cell.add_hull(arm=0, link=2, vertices=np.zeros((1, 3)))
    with pytest.raises(ValueError, match="order of its links"):
        cell.add_hull(arm=0, link=1, vertices=np.zeros((1, 3)))


def normal_between(a, b, step=1e-6):
    """Returns the slope of the distance [3] as the hull of points a moves."""
    moves = step * np.eye(3)
    return np.array([hull_gap(a + m, b) - hull_gap(a - m, b) for m in moves]) / (2 * step)


def test_near_contact_the_repulsive_force_has_the_direction_between_hulls():
    """Every sphere keeps the size of its force. Overlapping and distant hulls leave the force to the spheres."""
    rng = np.random.default_rng(7)
    field, steps = {"k_rep": 0.05, "d0": 0.5}, 21
    within, radius, bases = 0.2, 0.02, (0.0, 1.0, -0.9)
    turned = overlapping = far = 0
    for _ in range(6):
        hulls = [[drawn(rng, 4) + np.array([offset, 0, 0]) for offset in (-0.2, 0.2)] for _ in bases]
        cell, balls = core.Cell(), rng.uniform(-0.3, 0.3, (len(bases), 3, 3))
        for k, x in enumerate(bases):
            spheres = np.column_stack([balls[k], np.full(3, 0.1)])
            cell.add_arm(**chain(x), spheres=spheres, sphere_links=np.full(3, 2, dtype=np.int32))
            for vertices in hulls[k]:
                cell.add_hull(arm=k, link=2, vertices=vertices, radius=radius, protrusion=UNKNOWN_M)
        cell.freeze()
        q = rng.uniform(-np.pi, np.pi, (len(bases), steps, 2))
        motions = [core.Motion(cell, k, rows) for k, rows in enumerate(q)]
        settings = core.RepulsionSettings(**field, exact_within=within)
        found = core.repulsive_force(cell, motions[0], motions[1:], settings)
        assert not found[[0, -1]].any()
        for k in range(1, steps - 1):
            centres = placed(balls[0], bases[0], q[0, k])
            expected, size = np.zeros(2), 1.0
            for other in (1, 2):
                cloud = SimpleNamespace(centers=placed(balls[other], bases[other], q[other, k]), radii=np.full(3, 0.1))
                forces = np.array(
                    [sphere_force(p, 0.1, cloud, **field, distance="surface", floor=0.01) for p in centres]
                )
                pieces = [
                    (placed(a, bases[0], q[0, k]), placed(b, bases[other], q[other, k]))
                    for a in hulls[0]
                    for b in hulls[other]
                ]
                gaps = [hull_gap(a, b) - 2 * radius for a, b in pieces]
                if forces.any():
                    overlapping += min(gaps) <= 0
                    far += min(gaps) > within
                if 0 < min(gaps) < within and forces.any():
                    normal = normal_between(*pieces[int(np.argmin(gaps))])
                    forces = np.linalg.norm(forces, axis=1)[:, None] * normal
                    turned += 1
                expected += torques(forces, centres, q[0, k])
                size = max(size, np.abs(forces).max())
            np.testing.assert_allclose(found[k], expected, rtol=2e-3, atol=float(2e-3 * size))
    assert min(turned, overlapping, far) > 5, (turned, overlapping, far)


def torques(forces, points, q):
    """Returns the torques [2] of forces [n, 3] on points [n, 3] of the second link of the arm at the origin."""
    joints = np.array([[0.0, 0, 0], [np.cos(q[0]), np.sin(q[0]), 0]])
    return np.array([np.cross(points - joint, forces)[:, 2].sum() for joint in joints])


def hull_gap(a, b):
    """Returns the distance of two hulls; 0 if they overlap."""
    return distance_from_hull_to_origin((a[:, None] - b[None]).reshape(-1, 3))
