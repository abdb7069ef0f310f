"""The default cells: 2, 4, 6 or 8 equal arms in a ring on a table, facing the centre.

Radii are for arms of 0.85-0.92 m reach and scale with shorter ones. In the ring of eight, neighbours stand 0.54 m
apart.
"""

from __future__ import annotations

from numbers import Integral

import numpy as np

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.robot_reading import load_robot
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.wording import shown

RING_RADIUS_M = {2: 0.40, 4: 0.55, 6: 0.62, 8: 0.70}
"""Number of arms -> distance [m] of the bases from the centre, for arms of full reach."""
_SHORT_REACH_M, _SHORT_SCALE = 0.7, 0.73
_TABLE_BORDER_M, _TABLE_THICKNESS_M = 0.35, 0.10


def ring_radius(count: int, robot: str) -> float:
    """Returns the distance of the bases from the centre [m]; arms of short reach stand closer together."""
    return RING_RADIUS_M[count] * reach_scale(robot)


def reach_scale(robot: str) -> float:
    """Returns the scale of the distances between arms."""
    return _SHORT_SCALE if load_robot(robot).reach < _SHORT_REACH_M else 1.0


def cell_suffix(robot: str) -> str:
    """Returns the end of the name of a cell of equal arms."""
    return "" if robot == "ur5e" else f"-{load_robot(robot).name}"


def table_below(length: float, width: float) -> Obstacle:
    """Returns a table with its top at z = 0, around a rectangle [m] about the origin in which all bases stand."""
    return Obstacle(
        name="table",
        shape="box",
        position=frozen_array([0.0, 0.0, -_TABLE_THICKNESS_M / 2]),
        quaternion=frozen_array([1.0, 0.0, 0.0, 0.0]),
        size=frozen_array([round(edge + 2 * _TABLE_BORDER_M, 3) for edge in (length, width)] + [_TABLE_THICKNESS_M]),
    )


def ring_cell(count: int, robot: str = "ur5e", spheres: str = "28") -> Cell:
    """Makes a cell of equal arms in a ring on a table, facing the centre. The top of the table is z = 0.

    Args:
        count: number of arms: 2, 4, 6 or 8.
        robot: name of the robot, see `robot_names`.
        spheres: sphere set of all queries: `28`, `fine` or `exact`.

    Returns:
        The cell `ring-<count>`, or `ring-<count>-<robot>`, with arms `arm0`, `arm1`, ...

    Raises:
        UnknownNameError: for another count, robot or sphere set.
        MmpError: for a count that is not a whole number.
    """
    if not isinstance(count, Integral):
        raise MmpError(f"count is {shown(count)}; it must be one of the numbers {', '.join(map(str, RING_RADIUS_M))}")
    if count not in RING_RADIUS_M:
        raise UnknownNameError("ring size", count, map(str, RING_RADIUS_M))
    radius, height = ring_radius(count, robot), load_robot(robot).ring_height
    arms = []
    for k in range(count):
        angle = 2 * np.pi * k / count
        # Rounded to the millimetre and milliradian, so that a file holds the whole pose.
        position = [round(radius * np.cos(angle), 3) + 0.0, round(radius * np.sin(angle), 3) + 0.0, height]
        yaw = round(float(np.mod(angle + np.pi, 2 * np.pi)), 3)
        arms.append(place_arm(f"arm{k}", robot, position, quaternion_from_yaw(yaw)))
    table = table_below(2 * radius, 2 * radius)
    return Cell(name=f"ring-{count}{cell_suffix(robot)}", arms=tuple(arms), obstacles=(table,), spheres=spheres)
