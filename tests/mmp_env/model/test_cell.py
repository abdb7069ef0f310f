"""Arms at their base poses, made from names of robots and tools."""

import copy
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from mmp_env import Cell, MmpError, Obstacle, UnknownNameError, place_arm
from mmp_env.model.keep import Upright

UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def test_an_arm_has_its_robots_own_tool_a_named_one_or_none():
    tools = [place_arm("a", "panda", [0, 0, 0], UPRIGHT, **named).tool for named in ({}, {"tool": None})]
    assert [tool and tool.name for tool in tools] == ["franka-hand", None]
    assert place_arm("a", "fr5", [0, 0, 0], UPRIGHT, tool="franka-hand").tool.name == "franka-hand"


def test_a_quaternion_may_have_any_length():
    arm = place_arm("a", "ur5e", [0.1, 0.2, 0.3], [0.0, 0.0, 0.0, 4.0])
    np.testing.assert_allclose(arm.T_world_base, [[-1, 0, 0, 0.1], [0, -1, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])


@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        ([0, 0], UPRIGHT),
        ([0, 0, np.nan], UPRIGHT),
        ([[0, 0, 0]], UPRIGHT),
        ([0, 0, 0], [1, 0, 0]),
        ([0, 0, 0], [0, 0, 0, 0]),
        ([0, 0, 0], [np.inf, 0, 0, 0]),
    ],
)
def test_a_malformed_pose_is_refused(position, quaternion):
    with pytest.raises(MmpError, match=r"arm 'a' stands at .*; it needs three finite numbers"):
        place_arm("a", "ur5e", position, quaternion)


def test_unknown_names_are_answered_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'ur5e'"):
        place_arm("a", "ur5", [0, 0, 0], UPRIGHT)
    with pytest.raises(UnknownNameError, match="unknown tool 'hand'"):
        place_arm("a", "ur5e", [0, 0, 0], UPRIGHT, tool="hand")


@pytest.mark.parametrize("name", ["", "a/b", "two\nlines", "a" * 101, "\x1b[31m"])
def test_a_name_that_a_file_cannot_have_is_refused(name):
    arm = place_arm("a", "ur5e", [0, 0, 0], UPRIGHT)
    ball = Obstacle(name=name, shape="sphere", radius=0.1, position=np.ones(3), quaternion=np.array(UPRIGHT))
    for wrong in (
        {"name": name, "arms": (arm,)},
        {"name": "cell", "arms": (place_arm(name, "ur5e", [0, 0, 0], UPRIGHT),)},
        {"name": "cell", "arms": (arm,), "obstacles": (ball,)},
    ):
        with pytest.raises(MmpError, match="1 to 100 printable characters without '/'"):
            Cell(**wrong)


def test_a_ring_of_a_number_that_is_not_whole_is_refused_without_suggesting_it():
    code = "from mmp_env.model.rings import ring_cell; ring_cell('2')"  # without type checks
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.stderr.endswith("MmpError: count is '2'; it must be one of the numbers 2, 4, 6, 8\n")


def test_the_cell_of_one_arm_alone_keeps_obstacles_and_what_the_arm_may_touch():
    arms = (place_arm("a", "ur5e", [0, 0, 0], UPRIGHT), place_arm("b", "ur5e", [1, 0, 0], UPRIGHT))
    place = {"position": np.array([0.5, 0, 0]), "quaternion": np.array(UPRIGHT)}
    box = Obstacle(name="box", shape="box", size=np.full(3, 0.1), **place)
    mat = replace(box, name="mat", may_touch=frozenset({"a/forearm", "b/forearm"}))
    cell = Cell(
        name="two",
        arms=arms,
        obstacles=(box, mat),
        keep={
            "a": Upright(axis=np.array([0.0, 0.0, 1.0]), within=0.2),
            "b": Upright(axis=np.array([0.0, 0.0, 1.0]), within=0.3),
        },
    )
    alone = cell.alone("b")
    assert alone.arm_names == ("b",)
    assert alone.obstacles[0] is box
    assert alone.obstacles[1].may_touch == {"b/forearm"}
    assert alone.keep["b"].within == 0.3
    assert cell.alone("b") is alone
    assert copy.deepcopy(cell).alone("b") is not alone
    with pytest.raises(UnknownNameError, match="'c'"):
        cell.alone("c")
