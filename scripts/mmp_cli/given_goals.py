"""The options `--start`, `--goal`, `--degrees` and `--keep`: JSON, or the name of a file after an `@`."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.file_kinds import read_as
from mmp_env.files.instance_file import goals_from_dict
from mmp_env.files.reading import Location, NotJsonError, names_file, parse_json
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.goals import NAMED, STAY, AnyOf, Goal, JointGoal
from mmp_env.model.keep import Upright, as_keep

AT = "@"
_JSON_WORDS = ("null", "true", "false")
NAMED_GOALS = (*NAMED, STAY)
_KEEP = "--keep"


def given_goals(args: Namespace, cell: Cell, which: str) -> dict[str, Goal]:
    """Returns what --start or --goal asks for, arm name -> goal. An arm that --goal leaves out stays.

    Each value of the option is an object of all arms, @FILE with one, `NAME=GOAL`, or a named configuration of all
    arms. Raises `MmpError`.
    """
    option = f"--{which}"
    texts = [_of_all(text, cell) for text in getattr(args, which)]
    entries = list(_entries(texts, option, "configuration or goal"))
    data: dict[str, Any] = {}
    for given, _ in entries:
        if twice := data.keys() & given.keys():
            raise MmpError(f"{option} gives arm '{min(twice)}' twice; give one configuration or goal")
        data |= given
    place = entries[0][1] if len(entries) == 1 else Location(option)
    if which == "goal":
        data = dict.fromkeys(cell.arm_names, STAY) | data
    goals = goals_from_dict(cell, data, place)
    return {arm.name: _in_radians(arm, goals[arm.name]) for arm in cell.arms} if args.degrees else goals


def given_keep(args: Namespace, cell: Cell) -> dict[str, Upright] | None:
    """Returns the bounds of --keep, arm name -> bound; None if it is not given.

    Each value of the option is an object of all bounds, @FILE with one, or `NAME=BOUND`. Raises `MmpError`.
    """
    if not args.keep:
        return None
    out: dict[str, Upright] = {}
    for data, place in _entries(args.keep, _KEEP, "bound"):
        for arm, each in as_keep(data, cell.arm_names, str(place)).items():
            if arm in out:
                raise MmpError(f"{_KEEP} gives arm '{arm}' twice; give one bound")
            out[arm] = each
    return out


def _entries(texts: Sequence[str], option: str, what: str) -> Iterator[tuple[dict[str, Any], Location]]:
    """Yields the object of each value of an option, arm name -> `what`, and its place for messages."""
    for text in texts:
        name, equals, value = text.partition("=")
        if equals and not text.lstrip().startswith(("{", AT)):
            value = f'"{value}"' if value in NAMED_GOALS else value
            data, _ = _read(value, f"{option} {name.strip()}", f"{option} takes a file of a {what}")
            yield {name.strip(): data}, Location(option)
        else:
            data, place = _read(text, option, f"{option} takes a file of arm name -> {what}")
            if not isinstance(data, dict):
                raise place.wrong(data, f"an object of arm name -> {what}")
            yield data, place


def _of_all(text: str, cell: Cell) -> str:
    """Returns an object with a named configuration for all arms, where the text is just its name."""
    name = text.strip().strip('"')
    if not name.isalpha() or name in _JSON_WORDS:
        return text
    if name not in NAMED_GOALS:
        raise UnknownNameError("named configuration", name, NAMED_GOALS)
    return json.dumps(dict.fromkeys(cell.arm_names, name))


def _in_radians(arm: Arm, goal: Goal) -> Goal:
    """Returns a goal whose configurations are in degrees, slides in metres, with all of them in radians."""
    if isinstance(goal, AnyOf):
        return AnyOf([_in_radians(arm, each) for each in goal.goals])
    if not isinstance(goal, JointGoal) or len(goal.q) != arm.dof:  # a wrong number of joints is refused later
        return goal
    return JointGoal(np.where(arm.robot.slides, goal.q, np.radians(goal.q)))


def _read(given: str, option: str, takes: str) -> tuple[Any, Location]:
    """Returns what the value of an option holds, and its place for messages."""
    if given.startswith(AT):
        path = given.removeprefix(AT)
        if not path:
            raise MmpError(f"{option} is '{given}'; it must be JSON, or @FILE with the name of a JSON or YAML file")
        return read_as(path, (), takes), Location(path)
    try:
        return parse_json(given, Location(option)), Location(option)
    except NotJsonError as error:
        hint = f"; for a file write {option} {AT}{given}" if names_file(given) and "{" not in given else ""
        raise MmpError(f"{error}{hint}") from None
