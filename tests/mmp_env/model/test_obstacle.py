"""Obstacles: a shape has its own measures, and values of another form are refused when the obstacle is made."""

import re

import numpy as np
import pytest
from support.unchecked import unchecked

from mmp_env import MmpError, Obstacle

BOX = {"name": "o", "shape": "box", "position": [0, 0, 1], "quaternion": [1, 0, 0, 0], "size": [1, 1, 1]}


def test_lists_become_arrays_and_names_a_set():
    with unchecked():
        box = Obstacle(**BOX, may_touch=["arm0/hand"])
    np.testing.assert_array_equal(box.position, [0, 0, 1])
    assert box.may_touch == {"arm0/hand"}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"name": 3}, "name of an obstacle"),
        ({"shape": "bax"}, "unknown shape of obstacle 'o' 'bax'. Did you mean 'box'?"),
        ({"size": None}, "obstacle 'o' is a box without size; it needs size"),
        ({"radius": 1.0}, "obstacle 'o' is a box with radius; it has size only"),
        ({"pieces": (np.eye(3),)}, "obstacle 'o' is a box with pieces; it has size only"),
        ({"shape": "sphere"}, "obstacle 'o' is a sphere with size; it has radius only"),
        ({"shape": "capsule", "size": None, "radius": 1.0}, "a capsule without length; it needs radius and length"),
        ({"size": [1, 1, 0]}, "size of obstacle 'o' is [1.0, 1.0, 0.0]"),
        ({"size": [1, 1]}, "it must be lengths above 0 [m]"),
        ({"position": [0, 0, np.nan]}, "position of obstacle 'o'"),
        ({"quaternion": "x"}, "4 finite numbers that are not all zero"),
        ({"may_touch": "arm0"}, "may_touch of obstacle 'o' is 'arm0'"),
        ({"quaternion": [0, 0, 0, 0]}, "quaternion of obstacle 'o' is [0, 0, 0, 0]"),
        ({"name": "", "shape": "bax"}, "unknown shape of obstacle ''"),
        ({"radius": np.nan, "shape": "sphere", "size": None}, "radius of obstacle 'o' is nan"),
        ({"pieces": None}, "pieces of obstacle 'o' is None"),
        ({"may_touch": None}, "may_touch of obstacle 'o' is None"),
        ({"speed": -1}, "speed of obstacle 'o' is -1"),
        ({"shape": "mesh", "size": None, "pieces": (np.zeros(3),)}, "must be an array [v, 3] of"),
    ],
)
def test_other_values_are_refused_with_a_sentence(change, sentence):
    with unchecked(), pytest.raises(MmpError, match=re.escape(sentence)):
        Obstacle(**BOX | change)
