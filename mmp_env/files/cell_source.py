"""Cells by name or file: `ring-8`, `line-16-panda`, `mixed-4`, `mycell.yaml`, or the cell of an instance file."""

from __future__ import annotations

import dataclasses
import re
from os import PathLike
from pathlib import Path

from mmp_env.argument_checks import refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.paths import exists
from mmp_env.model.cell import MOST_ARMS, Cell
from mmp_env.model.lines import line_cell
from mmp_env.model.rings import RING_RADIUS_M, ring_cell
from mmp_env.model.robot_reading import load_robot
from mmp_env.robot_folders import robot_names

_CELLS = Path(__file__).parents[1] / "cells"
_NAMED = re.compile(r"(ring|line)-(\d{1,3})(?:-(.+))?")
_ROBOT = "ur5e"


def ring_names() -> list[str]:
    """Returns the names of the rings: `ring-<count>` of UR5e arms, `ring-<count>-<robot>` of others."""
    others = [f"-{name}" for name in robot_names() if name != _ROBOT]
    return [f"ring-{count}{suffix}" for count in RING_RADIUS_M for suffix in ["", *others]]


def layout_names() -> list[str]:
    """Returns the names of the cells in `mmp_env/cells`, which have arms of their own."""
    return sorted(path.stem for path in _CELLS.glob("*.json"))


def cell_names() -> list[str]:
    """Returns the names of the cells that `find_cell` knows; for lines of other numbers and robots, `line-16`."""
    return [*ring_names(), "line-16", *layout_names()]


def find_cell(source: Cell | str | PathLike[str], *, robot: str | None = None, spheres: str | None = None) -> Cell:
    """Returns a cell by its name or file.

    Args:
        source: a cell; the name of one, such as `ring-8`, `line-16`, `ring-4-panda` or `mixed-4`; or a cell file or
            instance file.
        robot: name of the robot of a ring or line; None for `ur5e`.
        spheres: sphere set, `28`, `fine` or `exact`; None for that of the cell. A ring or line has `28`, or `exact` if
            its robot is imported.

    Raises:
        UnknownNameError: for an unknown cell, robot or sphere set.
        MmpError: for a file that cannot be read, or a `robot` for a cell that has arms of its own.
    """
    if not isinstance(source, Cell | str | PathLike):
        raise refused("cell", source, "a Cell, a file, or the name of a cell, such as 'ring-4'")
    if isinstance(source, str) and (match := _NAMED.fullmatch(source)) and _exists(match[1], int(match[2])):
        layout, count, named = match[1], int(match[2]), match[3]
        if named and robot and named != robot:
            raise MmpError(f"cell '{source}' is a {layout} of {named} arms, but robot is '{robot}'; give one of them")
        arm = named or robot or _ROBOT
        make = ring_cell if layout == "ring" else line_cell
        return make(count, arm, spheres or load_robot(arm).ring_spheres)
    if isinstance(source, str) and source in layout_names():
        source = _CELLS / f"{source}.json"
    cell = source if isinstance(source, Cell) else _from_file(source)
    if robot is not None:
        raise MmpError(f"robot is '{robot}', but cell '{cell.name}' already says which arms it has")
    return cell if spheres in (None, cell.spheres) else dataclasses.replace(cell, spheres=spheres)


def _exists(layout: str, count: int) -> bool:
    return count in RING_RADIUS_M if layout == "ring" else 2 <= count <= MOST_ARMS


def _from_file(source: str | PathLike[str]) -> Cell:
    from mmp_env.files.cell_file import cell_from_dict
    from mmp_env.files.file_kinds import CELL, INSTANCES, read_for
    from mmp_env.files.instance_file import holds_instances, instances_from_dict
    from mmp_env.files.reading import names_file

    path = Path(source)
    if isinstance(source, str) and not exists(path) and not names_file(source):
        raise UnknownNameError("cell", source, cell_names())
    data = read_for("find_cell", source, CELL, INSTANCES)
    if holds_instances(data):
        return instances_from_dict(data, str(source), name=path.stem).cell
    return cell_from_dict(data, str(source), name=path.stem)
