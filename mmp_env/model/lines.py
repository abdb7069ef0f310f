"""Line cells: equal arms in two rows along a table, which face each other. The density does not depend on the number.

Distances are for arms of 0.85-0.92 m reach and scale with shorter ones.
"""

from __future__ import annotations

import numpy as np

from mmp_env.argument_checks import whole
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import MOST_ARMS, Cell
from mmp_env.model.rings import cell_suffix, reach_scale, table_below
from mmp_env.model.robot_reading import load_robot
from mmp_env.model.transforms import quaternion_from_yaw

_SPACING_M, _WIDTH_M = 0.60, 1.00
"""Distance of neighbours in a row, and of the two rows, for arms of full reach."""


def line_cell(count: int, robot: str = "ur5e", spheres: str = "28") -> Cell:
    """Makes a cell of equal arms in two rows along a table, which face each other. The top of the table is z = 0.

    Args:
        count: number of arms, from 2 to 256. Arms of even numbers stand in one row, the others in the other.
        robot: name of the robot, see `robot_names`.
        spheres: sphere set of all queries: `28`, `fine` or `exact`.

    Returns:
        The cell `line-<count>`, or `line-<count>-<robot>`, with arms `arm0`, `arm1`, ...

    Raises:
        UnknownNameError: for an unknown robot or sphere set.
        MmpError: for another count.
    """
    count = whole("count", count, 2, MOST_ARMS)
    scale = reach_scale(robot)
    spacing, width, columns = scale * _SPACING_M, scale * _WIDTH_M, (count + 1) // 2
    height = load_robot(robot).ring_height
    arms = []
    for k in range(count):
        column, row = divmod(k, 2)
        side = 1 if row else -1
        position = [round(spacing * (column - (columns - 1) / 2), 3) + 0.0, round(side * width / 2, 3), height]
        arms.append(place_arm(f"arm{k}", robot, position, quaternion_from_yaw(round(-side * np.pi / 2, 3))))
    table = table_below(spacing * (columns - 1), width)
    return Cell(name=f"line-{count}{cell_suffix(robot)}", arms=tuple(arms), obstacles=(table,), spheres=spheres)
