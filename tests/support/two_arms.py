"""Two UR5e that face each other, and problems between them small enough to know what happens."""

import itertools
from functools import cache

import numpy as np

from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.problem import make_problem
from mmp_env.model.transforms import quaternion_from_yaw


@cache
def facing_cell(distance_m=1.4):
    """Returns arms `left` and `right`, their bases that far apart; their hands can meet halfway."""
    half = distance_m / 2
    left = place_arm("left", "ur5e", [-half, 0, 0], quaternion_from_yaw(0.0))
    right = place_arm("right", "ur5e", [half, 0, 0], quaternion_from_yaw(np.pi))
    return Cell(name="facing", arms=(left, right))


def reaching(pan, elbow=1.0):
    """Returns a UR5e that reaches out towards the other arm, turned by `pan` [rad] about its upright first axis."""
    return np.array([np.pi + pan, -0.9, elbow, -1.6, -1.57, 0.0])


@cache
def turning(left, right, distance_m=1.4):
    """Returns a problem in which the arms turn from one pan to the other; `left`, `right`: (start, goal) [rad]."""
    pans = {"left": left, "right": right}
    start, goal = ({arm: reaching(pans[arm][k]) for arm in pans} for k in (0, 1))
    return make_problem(facing_cell(distance_m), start, goal, name="turning")


def passing(distance_m=1.4):
    """Returns both hands swing across, and meet halfway if both go straight."""
    return turning((0.8, -0.8), (0.8, -0.8), distance_m)


def one_moves():
    """The left arm turns a little, out of reach of the right one, which stands still."""
    return turning((1.5, 1.1), (1.0, 1.0))


def nothing_to_do():
    """Returns both arms are where they should be."""
    return turning((0.8, 0.8), (0.8, 0.8))


def parked_arm_between():
    """The right arm stands still where the hand of the left one would pass."""
    return turning((0.8, -0.8), (0.0, 0.0))


PROBLEMS = {kind.__name__: kind for kind in (passing, one_moves, nothing_to_do, parked_arm_between)}


def along(step, *places):
    """From place to place, each stretch in as few even steps as `step` [rad] of any joint allows."""
    rows = [np.asarray(places[0])[None]]
    for here, there in itertools.pairwise(places):
        count = int(np.ceil(np.abs(there - here).max() / step - 1e-6))
        rows.append(here + np.arange(1, count + 1)[:, None] / count * (there - here))
    return np.vstack(rows)
