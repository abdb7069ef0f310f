"""The checker's distances and motion bounds against brute force."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support import tiny_plans

from mmp_env.check.distance import chord_minimum, geom_support, solid_distance, tangent_minimum
from mmp_env.check.items import MotionSteps
from mmp_env.check.model import CellModel, enclosing_ball
from mmp_env.check.pairs import ChordDeviation
from mmp_env.check.reading import read_cell

few = settings(max_examples=20)  # each example tests twenty points or more
SHAPES = ("box", "sphere", "cylinder", "capsule")
points = arrays(float, (20, 3), elements=st.floats(-1.0, 1.0))
lengths = arrays(float, 3, elements=st.floats(0.05, 0.5))
shares = np.linspace(0.0, 1.0, 101)
ARM = np.array([0])


def grid(*sides):
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))


def surface(shape, size, count=40):
    """Returns points on the surface of a solid, about a hundredth of its size apart."""
    side = np.linspace(-1.0, 1.0, count)
    angle = np.linspace(0.0, 2 * np.pi, 2 * count)
    if shape == "box":
        face = grid(side, side)
        return np.concatenate([np.insert(face, axis, sign, axis=1) for axis in range(3) for sign in (-1, 1)]) * size
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    if shape == "cylinder":
        rim, height = grid(np.arange(len(angle)), side).T
        disc, radius = grid(np.arange(len(angle)), (side + 1) / 2).T
        wall = around[rim.astype(int)] * [size[0], size[0], 0] + height[:, None] * [0, 0, size[1]]
        caps, up = radius[:, None] * around[disc.astype(int)] * size[0], np.array([0, 0, size[1]])
        return np.concatenate([wall, caps + up, caps - up])
    tilt, turn = grid(np.linspace(-np.pi / 2, np.pi / 2, count), angle).T
    ball = size[0] * np.stack([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)], axis=1)
    if shape == "sphere":
        return ball
    rim, height = grid(np.arange(len(angle)), side).T
    wall = around[rim.astype(int)] * [size[0], size[0], 0] + height[:, None] * [0, 0, size[1]]
    shift = np.where(ball[:, 2:] < 0, -size[1], size[1]) * [0, 0, 1]
    return np.concatenate([ball + shift, wall])


@pytest.mark.parametrize("shape", SHAPES)
@few
@given(size=lengths, x=points)
def test_the_distance_to_a_solid_is_that_to_the_nearest_point_of_its_surface(shape, size, x):
    distance, _ = solid_distance(shape, size, x)
    nearest = np.linalg.norm(surface(shape, size) - x[:, None], axis=2).min(axis=1)
    assert (np.abs(distance) <= nearest + 1e-9).all()
    assert (nearest <= np.abs(distance) + 0.05).all()


@pytest.mark.parametrize("shape", SHAPES)
@few
@given(size=lengths, x=points)
def test_the_distance_is_negative_inside_and_positive_outside(shape, size, x):
    distance, _ = solid_distance(shape, size, x)
    radial, height = np.hypot(x[:, 0], x[:, 1]), np.abs(x[:, 2])
    inside = {
        "box": (np.abs(x) < size).all(axis=1),
        "sphere": np.hypot(radial, height) < size[0],
        "cylinder": (radial < size[0]) & (height < size[1]),
        "capsule": np.hypot(radial, np.maximum(height - size[1], 0.0)) < size[0],
    }[shape]
    assert (((distance < 0) == inside) | (np.abs(distance) < 1e-12)).all()


@pytest.mark.parametrize("shape", SHAPES)
@few
@given(size=lengths, x=points, y=points)
def test_the_gradient_supports_the_distance_from_below_everywhere(shape, size, x, y):
    here, gradient = solid_distance(shape, size, x)
    there, _ = solid_distance(shape, size, y)
    assert (np.linalg.norm(gradient, axis=1) <= 1 + 1e-12).all()
    assert (there >= here + np.sum(gradient * (y - x), axis=1) - 1e-12).all()


@pytest.mark.parametrize("shape", SHAPES)
@few
@given(size=lengths, x=points, y=points)
def test_tangents_at_the_ends_bound_the_distance_along_a_chord(shape, size, x, y):
    start, gradient = solid_distance(shape, size, x)
    end, gradient_back = solid_distance(shape, size, y)
    slopes = (np.sum(gradient * (y - x), axis=1), np.sum(gradient_back * (x - y), axis=1))
    bound = tangent_minimum(start, slopes[0], end, slopes[1])
    along, _ = solid_distance(shape, size, x + shares[:, None, None] * (y - x))
    assert (bound <= along.min(axis=0) + 1e-12).all()
    assert (bound >= np.minimum(start, end) - np.linalg.norm(y - x, axis=1)).all()


@few
@given(lines=arrays(float, (4, 20), elements=st.floats(-1.0, 1.0)))
def test_the_maximum_of_two_lines_is_least_at_the_returned_point(lines):
    start, slope, end, slope_back = lines
    met = np.maximum(start + shares[:, None] * slope, end + (1 - shares[:, None]) * slope_back).min(axis=0)
    bound = tangent_minimum(start, slope, end, slope_back)
    assert (bound <= met + 1e-12).all()
    assert (met <= bound + 0.011).all()


@few
@given(d=points, e=points)
def test_the_least_distance_of_two_moving_points_is_exact(d, e):
    met = np.linalg.norm(d + shares[:, None, None] * e, axis=2).min(axis=0)
    bound = chord_minimum(np.sum(d * d, axis=1), np.sum(d * e, axis=1), np.sum(e * e, axis=1))
    assert (bound <= met + 1e-7).all()
    assert (met <= bound + 0.01).all()


GEOMS = {
    "box": (mujoco.mjtGeom.mjGEOM_BOX, lambda size: surface("box", size)),
    "sphere": (mujoco.mjtGeom.mjGEOM_SPHERE, lambda size: surface("sphere", size)),
    "cylinder": (mujoco.mjtGeom.mjGEOM_CYLINDER, lambda size: surface("cylinder", size)),
    "capsule": (mujoco.mjtGeom.mjGEOM_CAPSULE, lambda size: surface("capsule", size)),
    "ellipsoid": (mujoco.mjtGeom.mjGEOM_ELLIPSOID, lambda size: surface("sphere", np.ones(3)) * size),
}


@pytest.mark.parametrize("shape", GEOMS)
@few
@given(size=lengths, seed=st.integers(0, 2**32))
def test_the_support_of_a_geom_is_that_of_its_farthest_point(shape, size, seed):
    kind, sampled = GEOMS[shape]
    direction = np.random.default_rng(seed).normal(size=(20, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    support = geom_support(np.full(20, int(kind)), np.tile(size, (20, 1)), direction)
    farthest = (sampled(size) @ direction.T).max(axis=0)
    assert (farthest <= support + 1e-12).all()
    assert (support <= farthest + 0.01).all()


def test_the_support_of_an_unknown_geom_proves_nothing():
    mesh = np.array([int(mujoco.mjtGeom.mjGEOM_MESH)])
    assert geom_support(mesh, np.ones((1, 3)), np.array([[1.0, 0.0, 0.0]]))[0] == np.inf


@few
@given(seed=st.integers(0, 2**32))
def test_a_ball_around_spheres_holds_them_all_and_is_not_much_too_large(seed):
    rng = np.random.default_rng(seed)
    centers, radii = rng.uniform(-1.0, 1.0, (12, 3)), rng.uniform(0.0, 0.3, 12)
    center, radius = enclosing_ball(centers, radii)
    assert (np.linalg.norm(centers - center, axis=1) + radii <= radius + 1e-12).all()
    apart = np.linalg.norm(centers[:, None] - centers, axis=2) + radii[:, None] + radii
    assert radius <= 1.3 * apart.max() / 2 + 0.3


ROBOTS = {
    name: CellModel(read_cell({"arms": [tiny_plans.arm("arm", [0.1, 0.2, 0.3], robot=name, yaw=0.7)]}))
    for name in ("ur5e", "panda", "fr5", "piper")
}


@pytest.mark.parametrize("robot", ROBOTS)
@few
@given(seed=st.integers(0, 2**32))
def test_no_point_of_a_link_comes_farther_from_an_axis_than_its_reach(robot, seed):
    model, rng = ROBOTS[robot], np.random.default_rng(seed)
    dof = model.cell.arms[0].dof
    body = model.mujoco.nbody - 1 - int(rng.integers(dof))
    point, radius = rng.uniform(-0.2, 0.2, 3), 0.1
    reach = model.reaches(body, point[None], np.array([radius]))
    for q in rng.uniform(-3.0, 3.0, (20, dof)):
        data = model.place(q)
        center = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point
        for k in np.flatnonzero(model.moves(body)):
            joint = data.joint(f"arm/joint{k + 1}")
            off = np.linalg.norm(np.cross(joint.xaxis, center - joint.xanchor))
            assert off + radius <= reach[k] + 1e-9
    assert (reach[~model.moves(body)] == 0).all()


def one_step(turn):
    """Returns a straight step of joints that turn by `turn` [n] [rad]."""
    turn = np.abs(turn)[None]
    return MotionSteps(start=np.array([0]), end=np.array([1]), move=turn, bend=np.zeros_like(turn))


@pytest.mark.parametrize("robot", ROBOTS)
@few
@given(seed=st.integers(0, 2**32), length=st.floats(0.001, 2.0))
def test_a_point_deviates_from_the_chord_by_at_most_the_bound(robot, seed, length):
    model, rng = ROBOTS[robot], np.random.default_rng(seed)
    dof = model.cell.arms[0].dof
    first, second = (int(k) for k in sorted(rng.choice(np.arange(2, 2 + dof), 2, replace=False)))  # the base is body 1
    point = rng.uniform(-0.2, 0.2, 3)
    start, turn = rng.uniform(-3.0, 3.0, dof), length * rng.uniform(-1.0, 1.0, dof)
    poses = model.poses(shares, start + shares[:, None] * turn)
    world = poses.positions[:, second] + poses.rotations[:, second] @ point
    inside = np.einsum("mji,mj->mi", poses.rotations[:, first], world - poses.positions[:, first])
    reach = model.reaches(second, point[None], np.zeros(1))[None]
    for path, common in ((world, np.zeros((1, dof), dtype=bool)), (inside, model.moves(first)[None])):
        chord = path[0] + shares[:, None] * (path[-1] - path[0])
        bound = ChordDeviation(model, ARM, reach, common)
        assert np.linalg.norm(path - chord, axis=1).max() <= bound.all(one_step(turn))[0, 0] + 1e-12
        only = np.array([0])
        assert bound.each(one_step(turn), only, only)[0] == pytest.approx(bound.all(one_step(turn))[0, 0])
    assert bound.all(one_step(turn))[0, 0] <= ChordDeviation(model, ARM, reach).all(one_step(turn))[0, 0]


def test_the_bound_is_met_by_a_point_that_turns_about_one_axis():
    model = ROBOTS["ur5e"]
    body = model.mujoco.nbody - 1
    point, turn = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.02])
    poses = model.poses(np.arange(3.0), np.outer([0.0, 0.5, 1.0], turn))
    path = poses.positions[:, body] + poses.rotations[:, body] @ point
    stray = np.linalg.norm(path[1] - (path[0] + path[2]) / 2)
    reach = model.reaches(body, point[None], np.zeros(1))[None]
    bound = ChordDeviation(model, ARM, reach).all(one_step(turn))[0, 0]
    assert stray == pytest.approx(bound, rel=1e-4)
