"""Instance files, schema `mmp-instances/1`: a cell, and named pairs of start and goal (docs/reference/files.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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
from mmp_env.files.cell_file import CellData, cell_from_data, name_or_stem
from mmp_env.files.file_kinds import INSTANCES, read_for
from mmp_env.files.reading import Location, decode_file, named, numbers
from mmp_env.files.solid_data import check_name
from mmp_env.model.cell import Cell
from mmp_env.model.goals import GOAL_FORMS, Goal, JointGoal, as_goal
from mmp_env.model.keep import Upright, as_keep
from mmp_env.model.margins import Margins
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem
from mmp_env.model.robot import frozen_array
from mmp_env.problems.making import make_problem
from mmp_env.wording import counted, shown

INSTANCES_SCHEMA = "mmp-instances/1"


class InstanceData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    name: str
    start: dict[str, Any]
    goal: dict[str, Any]
    keep: dict[str, Any] = {}


class InstancesData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    cell: CellData
    instances: list[InstanceData]
    name: str | None = None
    source: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Instance:
    """A start and a goal of an instance file, not yet tested for limits and collisions.

    Attributes:
        name: name of the instance.
        start: arm name -> what is asked for, such as a `JointGoal`.
        goal: arm name -> what is asked for.
        place: its place in the file, for messages.
        keep: arm name -> bound of its tool axis.
    """

    name: str
    start: Mapping[str, Goal]
    goal: Mapping[str, Goal]
    place: Location
    keep: Mapping[str, Upright] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        return f"{self.name} of {counted(len(self.start), 'arm')}"


@dataclass(frozen=True, kw_only=True, eq=False)
class InstanceFile:
    """A cell and its instances.

    Attributes:
        name: name of the file.
        cell: the cell of all instances.
        instances: at least one.
    """

    name: str
    cell: Cell
    instances: tuple[Instance, ...]

    @brief
    def __repr__(self) -> str:
        cell = f"{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"
        names = some([instance.name for instance in self.instances])
        return f"{self.name}: {counted(len(self.instances), 'instance')} ({names}) of {cell}"

    def instance(self, name: str) -> Instance:
        """Returns the instance of that name. Raises `UnknownNameError`."""
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
        """Returns the problem `<cell name>/<instance name>` of an instance.

        Args:
            instance: an instance of this file, or its name.
            max_velocity: as in `make_problem`.
            margin: as in `make_problem`.

        Raises:
            UnknownNameError: for an unknown name.
            InvalidInstanceError: if start or goal is out of limits, in collision, closer than a margin asked for, or
                breaks the bound of a tool axis.
        """
        if isinstance(instance, str):
            instance = self.instance(instance)
        given("instance", instance, Instance, "an Instance of this file, or the name of one")
        name = f"{self.cell.name}/{instance.name}"
        with named(f"{instance.place} ('{instance.name}')"):
            return make_problem(
                self.cell,
                instance.start,
                instance.goal,
                max_velocity=max_velocity,
                margin=margin,
                name=name,
                keep=instance.keep or None,
            )


def holds_instances(data: Any) -> bool:
    """Returns whether a file's `data` has a schema or instances, and is not a cell alone."""
    return isinstance(data, dict) and ("schema" in data or "instances" in data)


def load_instances(path: str | PathLike[str]) -> InstanceFile:
    """Reads an instance file, schema `mmp-instances/1`. docs/reference/files.md describes the fields.

    Args:
        path: a JSON or YAML file.

    Returns:
        The cell and its instances. `.problem(name)` makes a problem of one.

    Raises:
        MmpError: for a file that cannot be read, or a fault in it, with file, field and value.
    """
    return instances_from_dict(read_for("load_instances", path, INSTANCES), str(path), name=Path(path).stem)


def instances_from_dict(data: Any, where: str | Location, *, name: str = "instances") -> InstanceFile:
    """Returns the instances in a file's `data`.

    Args:
        where: begin of the messages, such as the name of the file.
        name: name of the file if the data has none.

    Raises:
        MmpError: for a fault, with field and value.
    """
    place, decoded = decode_file(data, INSTANCES_SCHEMA, InstancesData, where)
    name = name_or_stem(decoded.name, name, place / "name")
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
    """Returns a configuration [dof] [rad] for every arm of the cell. Raises `MmpError` with arm, joint and value."""
    check_arms(cell, data, place)
    return {
        arm.name: frozen_array(numbers(data[arm.name], arm.dof, place / arm.name, f"joint of a {arm.robot.name}"))
        for arm in cell.arms
    }


def goals_from_dict(cell: Cell, data: Any, place: Location) -> dict[str, Goal]:
    """Returns what is asked for of every arm of the cell. Raises `MmpError` with arm, field and value."""
    check_arms(cell, data, place, "configuration or goal")
    out: dict[str, Goal] = {}
    for arm in cell.arms:
        given, here = data[arm.name], place / arm.name
        if isinstance(given, list):
            out[arm.name] = JointGoal(frozen_array(numbers(given, arm.dof, here, f"joint of a {arm.robot.name}")))
        elif isinstance(given, str | dict):
            out[arm.name] = as_goal(given, str(here))
        else:
            raise here.wrong(given, GOAL_FORMS)
    return out


def check_arms(cell: Cell, data: Any, place: Location, what: str = "numbers") -> None:
    """Raises `MmpError` unless `data` is an object with exactly one entry for each arm of the cell."""
    if not isinstance(data, dict):
        raise place.wrong(data, f"an object of arm name -> {what}")
    for name in data:
        if name not in cell.arm_names:
            raise MmpError(f"{place}: {UnknownNameError('arm', shown(name)[1:-1], cell.arm_names)}")
    for name in cell.arm_names:
        if name not in data:
            raise MmpError(f"{place} has no arm '{name}'; it must have {', '.join(cell.arm_names)}")


def _instance(cell: Cell, data: InstanceData, place: Location) -> Instance:
    return Instance(
        name=data.name,
        start=goals_from_dict(cell, data.start, place / "start"),
        goal=goals_from_dict(cell, data.goal, place / "goal"),
        place=place,
        keep=as_keep(data.keep, cell.arm_names, str(place / "keep")),
    )
