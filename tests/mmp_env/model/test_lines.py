"""Line cells: two rows that face each other, at a density that does not depend on the number of arms."""

import numpy as np
import pytest

from mmp_env import find_cell, line_cell
from mmp_env.errors import MmpError, UnknownNameError


@pytest.mark.parametrize("robot", ["ur5e", "piper"])
@pytest.mark.parametrize("count", [2, 7, 16, 256])
def test_arms_stand_in_two_rows_that_face_each_other_on_one_table(count, robot):
    cell = line_cell(count, robot)
    scale = 1.0 if robot == "ur5e" else 0.73
    assert cell.arm_names == tuple(f"arm{k}" for k in range(count))
    bases = np.array([arm.position for arm in cell.arms])
    np.testing.assert_allclose(np.abs(bases[:, 1]), 0.5 * scale, atol=1e-3)
    for row, side in ((bases[::2], -1), (bases[1::2], 1)):
        assert (np.sign(row[:, 1]) == side).all()
        np.testing.assert_allclose(np.diff(row[:, 0]), 0.6 * scale, atol=2e-3)
    for arm in cell.arms:  # the x axis of the base points to the other row
        assert arm.T_world_base[1, 0] * arm.position[1] < 0
    (table,) = cell.obstacles
    assert (np.abs(bases[:, :2]).max(axis=0) < table.size[:2] / 2).all()
    assert table.position[2] + table.size[2] / 2 == 0


def test_lines_have_names():
    assert find_cell("line-16").name == line_cell(16).name == "line-16"
    assert find_cell("line-5", robot="panda").name == find_cell("line-5-panda").name == "line-5-panda"
    assert {arm.robot.name for arm in find_cell("line-5-panda").arms} == {"panda"}
    with pytest.raises(MmpError, match="'line-4-fr5' is a line of fr5 arms, but robot is 'ur5e'"):
        find_cell("line-4-fr5", robot="ur5e")


@pytest.mark.parametrize("name", ["line-1", "line-257", "line-", "line-4-nobody"])
def test_other_lines_are_unknown(name):
    with pytest.raises(UnknownNameError):
        find_cell(name)


@pytest.mark.parametrize("count", [1, 257])
def test_other_counts_are_refused(count):
    with pytest.raises(MmpError, match="2 or more, and 256 at most"):
        line_cell(count)
