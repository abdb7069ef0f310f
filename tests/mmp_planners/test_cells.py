"""Other cells than rings of equal arms: a single arm, and arms with different numbers of joints."""

import numpy as np
import pytest

from mmp_env import check_plan
from mmp_env.gym.instances import draw_instance
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.problems.making import make_problem
from mmp_planners import Status, make

PLANNERS = ("auto", "group-rrt", "rrt-connect", "prioritized", "gen-ecbs")
STRAIGHT = quaternion_from_yaw(0.0)
BACK = quaternion_from_yaw(np.pi)


def alone():
    """Returns a problem of one arm that must move around a post."""
    post = Obstacle(
        name="post",
        shape="box",
        position=frozen_array([0.45, 0.0, 0.5]),
        quaternion=frozen_array([1.0, 0.0, 0.0, 0.0]),
        size=frozen_array([0.06, 0.06, 1.0]),
    )
    return Cell(name="alone", arms=(place_arm("only", "ur5e", [0, 0, 0], STRAIGHT),), obstacles=(post,))


def seven_and_six():
    """Returns a problem of a Panda with its hand and a UR5e, within reach of each other."""
    seven = place_arm("seven", "panda", [-0.45, 0, 0], STRAIGHT)
    six = place_arm("six", "ur5e", [0.45, 0, 0], BACK)
    return Cell(name="seven and six", arms=(seven, six))


def six_and_seven():
    """Returns the same problem with the arms in the other order."""
    cell = seven_and_six()
    return Cell(name="six and seven", arms=cell.arms[::-1])


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("kind", [alone, seven_and_six, six_and_seven])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_kind_of_cell_is_planned(name, kind, seed):
    cell = kind()
    problem = make_problem(cell, *draw_instance(cell, seed=seed))
    result = make(name, shorten=100).plan(problem, seed=0, time_limit=60.0)
    assert result.status is Status.SOLVED
    assert [q.shape[1] for q in result.plan.positions.values()] == [arm.dof for arm in cell.arms]
    report = check_plan(result.plan)
    assert report.valid, report
    assert result.stats["cost_ratio"] < 3
