"""SOURCE of `mmp plan` and `mmp bench`: an environment id, an instance file, a cell file or a MuJoCo model."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mmp_cli.given_goals import AT, given_goals, given_keep
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.files.cell_source import find_cell
from mmp_env.files.file_kinds import CELL, INSTANCES, read_as
from mmp_env.files.instance_file import InstanceFile, holds_instances, instances_from_dict
from mmp_env.files.paths import exists
from mmp_env.files.reading import named, names_file
from mmp_env.gym.registration import ANY_CELL, CELLS
from mmp_env.importing.scene.model_cell import cell_from_mujoco
from mmp_env.importing.scene.model_file import is_model_file, load_model
from mmp_env.model.cell import Cell
from mmp_env.model.keep import Upright
from mmp_env.model.problem import Problem
from mmp_env.problems.making import make_problem

_MODULE = "mmp_env:"
_GIVEN = "given"


@dataclass(frozen=True, kw_only=True)
class InstanceSource:
    """One instance: `label` is its name in results, `problem` makes it.

    `problem` raises `InvalidInstanceError` if start or goal is out of limits or in collision, and `MmpError` if the
    task cannot draw an instance.
    """

    label: str
    problem: Callable[[], Problem]


@dataclass(frozen=True, kw_only=True)
class NamedCell:
    """A cell to draw instances in; the names of instances begin with `name`, and `title` also names the robot."""

    name: str
    title: str
    cell: Cell


def open_source(args: Namespace) -> NamedCell | InstanceFile:
    """Returns the cell or instance file of SOURCE. Raises `MmpError`, also for an option that SOURCE does not have."""
    source = args.source.removeprefix(_MODULE)
    if source in CELLS:
        _refuse(args, "an environment id", "instance", "arms")
        cell = find_cell(CELLS[source], robot=args.robot)
        title = source if cell.name == CELLS[source] else f"{source} {args.robot}"
        return NamedCell(name=source, title=title, cell=cell)
    if source == ANY_CELL:
        raise MmpError(f"'{source}' has no cell of its own; give a cell file, or one of {', '.join(CELLS)}")
    path = Path(args.source)
    if is_model_file(path):
        _refuse(args, "a MuJoCo model", "instance", "robot")
        with named(args.source):
            cell = cell_from_mujoco(load_model(path), getattr(args, "arms", None), name=path.stem)
        return NamedCell(name=cell.name, title=cell.name, cell=cell)
    _refuse(args, "no MuJoCo model", "arms")
    if not exists(path) and not names_file(args.source):
        raise UnknownNameError("environment id or file", args.source, CELLS)
    takes = "SOURCE is an environment id, an instance file or a cell file"
    data = read_as(args.source, (INSTANCES, CELL), takes)
    if holds_instances(data):
        _refuse(args, "an instance file", "robot", "task", "start", "goal", "degrees", "keep")
        return instances_from_dict(data, args.source, name=path.stem)
    _refuse(args, "a cell file", "instance", "robot")
    cell = cell_from_dict(data, args.source, name=path.stem)
    return NamedCell(name=cell.name, title=cell.name, cell=cell)


def read_source(args: Namespace) -> InstanceSource:
    """Returns the instance that the command line chooses. Raises `MmpError`."""
    opened = open_source(args)
    if isinstance(opened, NamedCell):
        return _from_cell(args, opened.cell, opened.name)
    with named(args.source):
        instance = opened.instances[0] if args.instance is None else opened.instance(args.instance)
    label = f"{opened.cell.name}/{instance.name}"
    return InstanceSource(label=label, problem=lambda: opened.problem(instance, **_limits(args)))


def files_read(args: Namespace) -> list[str]:
    """Returns the names of all files that `read_source` reads; SOURCE may also be a name that is no file."""
    given = (text for which in ("start", "goal", "keep") for text in getattr(args, which) or ())
    return [args.source, *(text.removeprefix(AT) for text in given if text.startswith(AT))]


def _from_cell(args: Namespace, cell: Cell, name: str) -> InstanceSource:
    keep = given_keep(args, cell)
    if args.start is None and args.goal is None:
        if args.degrees:
            raise MmpError("--degrees is for --start and --goal, and neither is given")
        label = f"{name}/{args.seed}"
        return InstanceSource(label=label, problem=lambda: _drawn(args, cell, label, keep))
    for given, other in (("start", "goal"), ("goal", "start")):
        if getattr(args, other) is None:
            raise MmpError(f"--{other} is missing; --{given} is there, and the two go together, such as --start home")
    if args.task is not None:
        raise MmpError(f"--task is '{args.task}' beside --start and --goal; an instance is drawn or given, not both")
    start, goal = given_goals(args, cell, "start"), given_goals(args, cell, "goal")
    label = f"{name}/{_GIVEN}"

    def problem() -> Problem:
        with named(args.source):
            return make_problem(cell, start, goal, **_limits(args), name=label, keep=keep)

    return InstanceSource(label=label, problem=problem)


def _drawn(args: Namespace, cell: Cell, label: str, keep: Mapping[str, Upright] | None) -> Problem:
    """Returns the instance of `env.reset(seed=...)` in this cell."""
    from mmp_env.gym.instances import DEFAULT_TASK, draw_problem

    return draw_problem(cell, args.task or DEFAULT_TASK, args.seed, **_limits(args), name=label, keep=keep)


def _limits(args: Namespace) -> dict[str, Any]:
    """Returns the margin and the velocity limit that were given, as arguments of `make_problem`."""
    velocity = getattr(args, "max_velocity", None)
    return {"margin": args.margin} | ({} if velocity is None else {"max_velocity": velocity})


def _refuse(args: Namespace, kind: str, *options: str) -> None:
    """Raises `MmpError` if an option was given that this kind of source does not have."""
    for option in options:
        value = getattr(args, option, None)  # some commands lack some options
        if value not in (None, False):
            given = "given" if isinstance(value, bool | list) else f"'{value}'"
            raise MmpError(f"--{option} is {given}, but '{args.source}' is {kind}, which has no {option} to choose")
