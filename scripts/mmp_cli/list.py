"""`mmp list`: robots, tools, cells, tasks, and planners with their options."""

from __future__ import annotations

import dataclasses
import json
from argparse import Namespace
from collections.abc import Callable, Iterator
from typing import Any

from mmp_cli.arguments import Parser
from mmp_cli.child_call import call_in_child
from mmp_cli.output import one_line, shortened
from mmp_env.errors import MmpError, in_words
from mmp_env.files.writing import plain


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp list", "Lists robots, tools, cells, tasks, and planners with their options.")
    out.add_argument("--json", action="store_true", help="print one JSON object")
    return out


def run(args: Namespace) -> int:
    """Runs the command."""
    found = inventory()
    if args.json:
        print(json.dumps(found))
    else:
        from mmp_cli.output import print_rows

        print_rows(_rows(found))
    return 0


def inventory() -> dict[str, list[dict[str, Any]]]:
    """Returns robots, tools, cells, tasks and planners. A planner or task that does not load has an `error` only."""
    import mmp_planners
    import mmp_tasks
    from mmp_env.gym.registration import CELLS
    from mmp_env.model.robot_reading import load_robot
    from mmp_env.plugins import TASKS
    from mmp_env.robot_folders import robot_names, tool_names
    from mmp_planners import registry

    robots = [load_robot(name) for name in robot_names()]
    return {
        "robots": [{"name": r.name, "title": r.title, "joints": r.dof, "tool": r.default_tool} for r in robots],
        "tools": [_tool(name) for name in tool_names()],
        "cells": [_cell(name, cell) for name, cell in CELLS.items()],
        "tasks": [_plugin(_task, name, TASKS.is_foreign) for name in mmp_tasks.names()],
        "planners": [_plugin(_planner, name, registry.is_foreign) for name in mmp_planners.names()],
    }


def _tool(name: str) -> dict[str, Any]:
    from mmp_env.model.robot_reading import load_tool, tool_states
    from mmp_env.robot_folders import find_tool

    tool, folder = load_tool(name), find_tool(name)
    return {"name": name, "point": tool.point.tolist(), "states": tool_states(folder) if folder else []}


def _plugin(describe: Callable[[str], dict[str, Any]], name: str, is_foreign: Callable[[str], bool]) -> dict[str, Any]:
    """Describes a plug-in; one of another package is imported by a child process and not by this one."""
    try:
        return call_in_child(describe, name) if is_foreign(name) else describe(name)
    except MmpError as error:
        return {"name": name, "error": in_words(error)}


def _cell(name: str, cell: str) -> dict[str, Any]:
    """Describes a cell; one that takes any robot has its `layout` instead of `robots`."""
    from mmp_env.files.cell_source import find_cell, layout_names

    robots = [arm.robot.name for arm in find_cell(cell).arms]
    out = {"name": name, "arms": len(robots)}
    if cell in layout_names():
        return out | {"robots": robots}
    return out | {"layout": "line" if cell.startswith("line-") else "ring"}


def _task(name: str) -> dict[str, Any]:
    import mmp_tasks

    found = mmp_tasks.describe(name)
    options = [{"name": key, "default": _value(default)} for key, default in found.options.items()]
    return {"name": name, "summary": found.summary, "options": options}


def _planner(name: str) -> dict[str, Any]:
    import mmp_planners

    found = mmp_planners.describe(name)
    options = [{"name": o.name, "type": o.type, "default": _value(o.default), "doc": o.doc} for o in found.options]
    about = dataclasses.asdict(found.about) if found.about else {}
    return {"name": name, "summary": found.summary, **about, "options": options}


def _value(default: Any) -> Any:
    """Returns a default as a JSON value, or as text if JSON has no such value."""
    try:
        return plain(default)
    except TypeError:
        return str(default)


def _rows(found: dict[str, list[dict[str, Any]]]) -> Iterator[tuple[str, str, str]]:
    for kind, items in found.items():
        yield kind, "bold", ""
        for item in items:
            yield f"  {item['name']}", "", _words(kind, item)
            for key in ("paper", "guarantee"):
                if item.get(key):
                    yield f"    {key}", "dim", item[key]
            for option in item.get("options", ()):
                doc = f": {option['doc']}" if option.get("doc") else ""
                yield f"    {option['name']}", "dim", f"{json.dumps(option['default'])}{doc}"


def _words(kind: str, item: dict[str, Any]) -> str:
    if "error" in item:
        return shortened(one_line(item["error"]))
    if kind == "robots":
        tool = f", with {item['tool']}" if item["tool"] else ""
        return f"{item['title']}, {item['joints']} joints{tool}"
    if kind == "tools":
        states = f", states {', '.join(item['states'])}" if item["states"] else ""
        return f"tool point at [{', '.join(f'{x:g}' for x in item['point'])}] m{states}"
    if kind == "cells":
        return f"{item['arms']} arms" + (
            f": {', '.join(item['robots'])}" if "robots" in item else f" in a {item['layout']}, any robot"
        )
    return item["summary"]
