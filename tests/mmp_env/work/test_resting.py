"""Tests the supports that objects rest on."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env.check.checked import Solid
from mmp_env.check.resting import carriers
from mmp_env.model.arm import Obstacle
from mmp_env.model.transforms import matrix_from_quaternion, quaternion_from_matrix, quaternion_from_yaw
from mmp_env.work.resting import distance, supports, width_across


def box(name, x, y, z, size=(0.1, 0.1, 0.1), yaw=0.0):
    """Returns a box whose underside is at a height."""
    position = np.array([x, y, z + size[2] / 2])
    return Obstacle(name=name, shape="box", position=position, quaternion=quaternion_from_yaw(yaw), size=np.array(size))


def checked(solid):
    return Solid(
        name=solid.name,
        shape=solid.shape,
        size=solid.half_size,
        position=solid.position,
        quaternion=solid.quaternion,
    )


TABLE = box("table", 0, 0, -0.1, (2, 2, 0.1))
LOW = box("low", 0.0, 0.0, 0.0)
CASES = {
    "on a table": (box("a", 0.5, 0.5, 0.0), [TABLE], ["table"]),
    "1 mm above": (box("a", 0.5, 0.5, 0.001), [TABLE], ["table"]),
    "5 mm above": (box("a", 0.5, 0.5, 0.005), [TABLE], []),
    "5 mm below": (box("a", 0.5, 0.5, -0.005), [TABLE], []),
    "on a box": (box("a", 0.02, 0.0, 0.1), [TABLE, LOW], ["low"]),
    "beside its centre": (box("a", 0.06, 0.0, 0.1), [TABLE, LOW], []),
    "larger than what carries it": (box("a", 0.0, 0.0, 0.1, (0.5, 0.5, 0.02)), [TABLE, LOW], ["low"]),
    "a cross": (box("a", 0.0, 0.0, 0.1, (0.5, 0.05, 0.02)), [box("low", 0, 0, 0, (0.05, 0.5, 0.1))], ["low"]),
    "a bridge": (
        box("a", 0.0, 0.0, 0.1, (0.5, 0.1, 0.02)),
        [box("left", -0.2, 0, 0), box("right", 0.2, 0, 0)],
        ["left", "right"],
    ),
    "half a bridge": (box("a", 0.0, 0.0, 0.1, (0.5, 0.1, 0.02)), [box("left", -0.2, 0, 0)], []),
    "turned": (box("a", 0.5, 0.5, 0.0, yaw=0.7), [TABLE], ["table"]),
}


@pytest.mark.parametrize("name", CASES)
def test_an_object_rests_on_flat_tops_below_its_centre(name):
    solid, others, wanted = CASES[name]
    found, why = supports(solid, others)
    assert found == wanted
    assert bool(why) is not bool(wanted)


@pytest.mark.parametrize("name", CASES)
def test_the_checker_finds_the_same(name):
    solid, others, wanted = CASES[name]
    assert carriers(checked(solid), [checked(other) for other in others]) == wanted


def test_random_places_are_judged_alike():
    rng, agreed = np.random.default_rng(0), {True: 0, False: 0}
    for _ in range(200):
        size = rng.uniform(0.05, 0.2, 3)
        solid = box("a", *rng.uniform(-0.12, 0.12, 2), 0.1, tuple(size), rng.uniform(-3, 3))
        wanted = supports(solid, [LOW])[0]
        moved = [box("a", *(solid.position[:2] * k), 0.1, tuple(size), 0.0) for k in (0.95, 1.05)]
        near = len({bool(supports(each, [LOW])[0]) for each in moved}) > 1
        if not near:
            agreed[bool(wanted)] += carriers(checked(solid), [checked(LOW)]) == wanted
    assert min(agreed.values()) > 20


def test_a_ball_lies_on_a_table_and_nothing_lies_on_a_ball():
    ball = Obstacle(name="ball", shape="sphere", position=np.array([0, 0, 0.05]), quaternion=np.eye(4)[0], radius=0.05)
    assert supports(ball, [TABLE])[0] == ["table"]
    assert supports(box("a", 0, 0, 0.1), [ball])[0] == []


def test_distances_and_widths_of_solids():
    assert distance(LOW, np.array([0.0, 0.0, 0.13])) == pytest.approx(0.03)
    assert distance(LOW, np.array([0.01, 0.0, 0.05])) == 0.0
    turn = {"position": np.zeros(3), "quaternion": np.eye(4)[0]}
    can = Obstacle(name="can", shape="cylinder", radius=0.03, length=0.2, **turn)
    assert distance(can, np.array([0.04, 0.0, 0.0])) == pytest.approx(0.01)
    assert width_across(can, np.array([0.0, 0.0, 1.0])) == pytest.approx(0.06, rel=0.01)
    assert width_across(box("a", 0, 0, 0, (0.04, 0.2, 0.3)), np.array([0, 0, 1.0])) == pytest.approx(0.04, rel=0.01)


def test_quaternions_of_rotation_matrices():
    rng = np.random.default_rng(1)
    for _ in range(50):
        turn = matrix_from_quaternion(rng.normal(size=4))
        assert matrix_from_quaternion(quaternion_from_matrix(turn)) == pytest.approx(turn, abs=1e-12)
    for half_turn in (np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])):
        assert matrix_from_quaternion(quaternion_from_matrix(half_turn)) == pytest.approx(half_turn)
