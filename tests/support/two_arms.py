"""Two UR5e that face each other, and small problems with a known outcome."""

import itertools
from functools import cache

import numpy as np

from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.problems.making import make_problem


@cache
def facing_cell(distance_m=1.4):
    """Returns a cell of arms `left` and `right` at this distance of their bases. Their hands can touch halfway."""
    half = distance_m / 2
    left = place_arm("left", "ur5e", [-half, 0, 0], quaternion_from_yaw(0.0))
    right = place_arm("right", "ur5e", [half, 0, 0], quaternion_from_yaw(np.pi))
    return Cell(name="facing", arms=(left, right))


def reaching(pan, elbow=1.0):
    """Returns a configuration that reaches towards the other arm, turned by `pan` [rad] about the first axis."""
    return np.array([np.pi + pan, -0.9, elbow, -1.6, -1.57, 0.0])


@cache
def turning(left, right, distance_m=1.4):
    """Returns a problem in which the arms turn from one pan to another; `left`, `right`: (start, goal) [rad]."""
    pans = {"left": left, "right": right}
    start, goal = ({arm: reaching(pans[arm][k]) for arm in pans} for k in (0, 1))
    return make_problem(facing_cell(distance_m), start, goal, name="turning")


def passing(distance_m=1.4):
    """Returns a problem in which both hands swing across. Straight lines collide halfway."""
    return turning((0.8, -0.8), (0.8, -0.8), distance_m)


def one_moves():
    """Returns a problem in which the left arm turns a little, out of reach of the right arm, which stands still."""
    return turning((1.5, 1.1), (1.0, 1.0))


def nothing_to_do():
    """Returns a problem in which both arms are at their goals."""
    return turning((0.8, 0.8), (0.8, 0.8))


def parked_arm_between():
    """Returns a problem in which the right arm stands still on the straight line of the left hand."""
    return turning((0.8, -0.8), (0.0, 0.0))


PROBLEMS = {kind.__name__: kind for kind in (passing, one_moves, nothing_to_do, parked_arm_between)}


def along(step, *places):
    """Returns a path through places. Each part has the fewest even steps of at most `step` [rad] of any joint."""
    rows = [np.asarray(places[0])[None]]
    for here, there in itertools.pairwise(places):
        count = int(np.ceil(np.abs(there - here).max() / step - 1e-6))
        rows.append(here + np.arange(1, count + 1)[:, None] / count * (there - here))
    return np.vstack(rows)
