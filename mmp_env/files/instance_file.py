"""Instance files, schema `mmp-instances/1`: a cell, and named pairs of start and goal (docs/reference/files.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import given
from mmp_env.brief import brief, some
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_file import CellData, cell_from_data, check_name
from mmp_env.files.file_kinds import INSTANCES, read_for
from mmp_env.files.reading import Location, check_schema, decode, named, numbers
from mmp_env.model.cell import Cell
from mmp_env.model.margins import Margins
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem, make_problem
from mmp_env.model.robot import frozen_array
from mmp_env.wording import counted, shown

INSTANCES_SCHEMA = "mmp-instances/1"


class InstanceData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    name: str
    start: dict[str, Any]
    goal: dict[str, Any]


class InstancesData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    cell: CellData
    instances: list[InstanceData]
    name: str | None = None
    source: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Instance:
    """A start and a goal, arm name -> [dof] [rad], of the right form; whether they are free is not yet known."""

    name: str
    start: Mapping[str, Float[np.ndarray, "dof"]]
    goal: Mapping[str, Float[np.ndarray, "dof"]]
    place: Location
    """Where it stands, for messages."""

    @brief
    def __repr__(self) -> str:
        return f"{self.name} of {counted(len(self.start), 'arm')}"


@dataclass(frozen=True, kw_only=True, eq=False)
class InstanceFile:
    """A cell and its instances, at least one."""

    name: str
    cell: Cell
    instances: tuple[Instance, ...]

    @brief
    def __repr__(self) -> str:
        cell = f"{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"
        names = some([instance.name for instance in self.instances])
        return f"{self.name}: {counted(len(self.instances), 'instance')} ({names}) of {cell}"

    def instance(self, name: str) -> Instance:
        """The instance of that name. Raises `UnknownNameError`."""
        for instance in self.instances:
            if instance.name == name:
                return instance
        raise UnknownNameError("instance", name, [instance.name for instance in self.instances])

    def problem(
        self,
        instance: Instance | str,
        *,
        max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
        margin: float | Mapping[str, float] | Margins | None = None,
    ) -> Problem:
        """The problem `<cell name>/<instance name>` of an instance of this file, or of the one of that name.

        Raises `UnknownNameError`, and `InvalidInstanceError` where start or goal is out of limits or in collision.
        """
        if isinstance(instance, str):
            instance = self.instance(instance)
        given("instance", instance, Instance, "an Instance of this file, or the name of one")
        name = f"{self.cell.name}/{instance.name}"
        with named(f"{instance.place} ('{instance.name}')"):
            return make_problem(
                self.cell, instance.start, instance.goal, max_velocity=max_velocity, margin=margin, name=name
            )


def holds_instances(data: Any) -> bool:
    """Whether a file's `data` means to be of a schema, such as instances, and not a cell alone."""
    return isinstance(data, dict) and ("schema" in data or "instances" in data)


def load_instances(path: str | PathLike[str]) -> InstanceFile:
    """The instances in a file. Raises `MmpError` that names file, field and value."""
    return instances_from_dict(read_for("load_instances", path, INSTANCES), str(path), name=Path(path).stem)


def instances_from_dict(data: Any, where: str | Location, *, name: str = "instances") -> InstanceFile:
    """The instances in a file's `data`; `where` begins the messages, `name` stands in where the data has none.

    Raises `MmpError` that names field and value.
    """
    place = where if isinstance(where, Location) else Location(where)
    check_schema(data, INSTANCES_SCHEMA, place)
    decoded = decode(data, InstancesData, place)
    if decoded.name is not None:
        check_name(decoded.name, place / "name")
        name = decoded.name
    if not decoded.instances:
        raise MmpError(f"{place / 'instances'} is empty; it needs at least one instance")
    cell = cell_from_data(decoded.cell, place / "cell", name=name)
    seen: set[str] = set()
    for k, item in enumerate(decoded.instances):
        check_name(item.name, place / "instances" / k / "name")
        if item.name in seen:
            raise MmpError(
                f"{place / 'instances' / k / 'name'} is '{item.name}' for the second time; names must differ"
            )
        seen.add(item.name)
    instances = tuple(_instance(cell, item, place / "instances" / k) for k, item in enumerate(decoded.instances))
    return InstanceFile(name=name, cell=cell, instances=instances)


def configurations_from_dict(cell: Cell, data: Any, place: Location) -> dict[str, Float[np.ndarray, "dof"]]:
    """One configuration [dof] [rad] for every arm of the cell. Raises `MmpError` that names arm, joint and value."""
    check_arms(cell, data, place)
    return {
        arm.name: frozen_array(numbers(data[arm.name], arm.dof, place / arm.name, f"joint of a {arm.robot.name}"))
        for arm in cell.arms
    }


def check_arms(cell: Cell, data: Any, place: Location) -> None:
    """Raises `MmpError` unless `data` is an object with an entry for each arm of the cell and for nothing else."""
    if not isinstance(data, dict):
        raise place.wrong(data, "an object of arm name -> numbers")
    for name in data:
        if name not in cell.arm_names:
            raise MmpError(f"{place}: {UnknownNameError('arm', shown(name)[1:-1], cell.arm_names)}")
    for name in cell.arm_names:
        if name not in data:
            raise MmpError(f"{place} has no arm '{name}'; it must have {', '.join(cell.arm_names)}")


def _instance(cell: Cell, data: InstanceData, place: Location) -> Instance:
    return Instance(
        name=data.name,
        start=configurations_from_dict(cell, data.start, place / "start"),
        goal=configurations_from_dict(cell, data.goal, place / "goal"),
        place=place,
    )
