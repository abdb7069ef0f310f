"""Draws in which an arm is cut off from its goal even alone: the task `reach` draws again."""

from dataclasses import replace

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.rings import ring_cell
from mmp_tasks.alone import has_path_alone
from mmp_tasks.reach import Reach


def cell_with_short_limits():
    """Returns two UR5e whose shoulders turn by half a turn to each side, so that the table cuts their space in two."""
    cell = ring_cell(2)
    lower, upper = np.array(cell.arms[0].robot.lower), np.array(cell.arms[0].robot.upper)
    lower[1], upper[1] = -np.pi, np.pi
    box = {
        "lower": lower,
        "upper": upper,
        "draw_lower": np.maximum(lower, -np.pi),
        "draw_upper": np.minimum(upper, np.pi),
    }
    return replace(cell, arms=tuple(replace(arm, robot=replace(arm.robot, **box)) for arm in cell.arms))


def over_the_back(cell):
    """Returns a start and a goal of which the first arm reaches one over its back and the other not."""
    here = {arm.name: np.array([0.0, -1.5, 1.0, 0.5, 1.0, 0.0]) for arm in cell.arms}
    return here, here | {"arm0": np.array([0.0, 3.0, 1.0, -1.0, 1.0, 0.0])}


def test_an_arm_that_limits_and_table_cut_off_is_found():
    cell = cell_with_short_limits()
    start, goal = over_the_back(cell)
    assert not has_path_alone(cell, "arm0", start["arm0"], goal["arm0"])
    the_same_place = goal | {"arm0": goal["arm0"] - [0.0, 2 * np.pi, 0.0, 0.0, 0.0, 0.0]}
    assert has_path_alone(ring_cell(2), "arm0", start["arm0"], the_same_place["arm0"])
    assert has_path_alone(cell, "arm0", start["arm0"], start["arm0"])


def test_reach_draws_again_until_each_arm_alone_has_a_path():
    cell = cell_with_short_limits()
    for seed in range(12):
        start, goal = Reach().sample(cell, np.random.default_rng(seed))
        for arm in cell.arms:  # both on the same side of the table
            assert (start[arm.name][1] > np.pi / 2) == (goal[arm.name][1] > np.pi / 2)


def test_reach_says_which_arm_is_cut_off_in_every_draw():
    cell, draws = cell_with_short_limits(), Reach(draws=1)
    messages = []
    for seed in range(40):
        try:
            draws.sample(cell, np.random.default_rng(seed))
        except MmpError as error:
            messages.append(str(error))
    assert any("which finds no path from its start to its goal even alone" in message for message in messages)
