"""`mmp tool add`: imports a gripper from URDF or MJCF, in one or several named states."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from typing import Any

from mmp_cli.arguments import Parser
from mmp_cli.import_progress import ImportProgress
from mmp_cli.output import print_rows, printable
from mmp_env.errors import MmpError, UnknownNameError

_ACTIONS = {"add": "import a gripper from a URDF or MJCF file"}
_HELP = """usage: mmp tool {add} ...

Brings a gripper of your own: its file becomes a tool that the arms of a cell take by name.

commands:
%s

`mmp tool COMMAND --help` lists the options of a command.
"""


class _Tool:
    """The parser of the command, which chooses that of the action."""

    def parse(self, argv: list[str]) -> Namespace:
        """Returns the arguments with the function `act` that runs the action. Raises `MmpError`."""
        if not argv or argv[0] in ("-h", "--help"):
            print(_overview(), end="", file=sys.stdout if argv else sys.stderr)
            raise SystemExit(0 if argv else 2)
        if argv[0] not in _ACTIONS:
            raise UnknownNameError("command of mmp tool", argv[0], _ACTIONS)
        args = _add_parser().parse(argv[1:])
        args.act = _add
        return args

    def format_help(self) -> str:
        """Returns the help of the command and of all actions."""
        return "\n".join([_overview(), _add_parser().format_help()])


def _overview() -> str:
    return _HELP % "\n".join(f"  {name:5}  {summary}" for name, summary in _ACTIONS.items())


def parser() -> Any:
    """The arguments of the command."""
    return _Tool()


def run(args: Namespace) -> int:
    """Runs the command."""
    act: Callable[[Namespace], int] = args.act
    return act(args)


def _add_parser() -> Parser:
    out = Parser("mmp tool add", "Imports the gripper in a URDF or MJCF file as a tool folder.")
    out.add_argument("source", metavar="SOURCE", help="a .urdf or .xml file; its world is the frame of the flange")
    out.add_argument("--name", required=True, help="name of the tool")
    out.add_argument(
        "--state",
        metavar="NAME=JOINTS",
        action="append",
        default=[],
        help="a named state and the values of its joints [m or rad]: open=finger1=0.04,finger2=0.04, or open=0.04,0.04"
        " with one value for each joint; other joints keep the value of the file. May be given several times",
    )
    out.add_argument(
        "--tip",
        metavar="BODY_OR_SITE",
        help="its origin is the tool point; by default one of a usual name",
    )
    out.add_argument(
        "--package-dir", metavar="DIR", action="append", default=[], help="where packages of package:// paths are"
    )
    out.add_argument("--out", metavar="DIR", help="folder for the tool's folder; by default the user's data folder")
    out.add_argument("--json", action="store_true", help="print one JSON object")
    return out


def _add(args: Namespace) -> int:
    from mmp_env.importing.tool_folder import ToolOptions, add_tool, summary
    from mmp_env.model.names import NAMES, is_name
    from mmp_env.robot_folders import find_tool, tool_cache_folder, user_tool_folder

    if not is_name(args.name) or args.name.startswith(".") or args.name == "none":
        raise MmpError(f"--name is {printable(args.name)}; it must be {NAMES}, and not 'none'")
    if args.out is None:
        there = find_tool(args.name)
        if there is not None and there.parent != user_tool_folder():
            raise MmpError(f"--name {args.name} is the name of a tool in {there}; choose another")
    options = ToolOptions(
        name=args.name, states=_states(args.state), point=args.tip, package_dirs=tuple(args.package_dir)
    )
    with ImportProgress("mmp tool add") as progress:
        made = add_tool(
            args.source, args.out or user_tool_folder(), options, cache=tool_cache_folder(), progress=progress
        )
    found = summary(made.folder) | {"replaced": made.replaced}
    if args.json:
        print(json.dumps(found))
    else:
        print_rows(_rows(found, made.from_cache))
    return 0


def _states(given: list[str]) -> dict[str, str]:
    from mmp_env.model.names import NAMES, is_name

    out: dict[str, str] = {}
    for text in given:
        name, equals, joints = text.partition("=")
        if not equals or not is_name(name) or name.startswith("."):
            raise MmpError(f"--state is {printable(text)}; it must be NAME=JOINTS, where NAME is {NAMES}")
        if name in out:
            raise MmpError(f"--state {name} is given twice; the names of states must differ")
        out[name] = joints
    return out


def _rows(found: dict[str, Any], from_cache: bool) -> Iterator[tuple[str, str, str]]:
    yield "tool", "bold", f"{found['name']}: {found['title']}"
    for name, state in found["states"].items():
        joints = ", ".join(f"{joint} {value:g}" for joint, value in state["joints"].items())
        yield "joints" if list(found["states"]) == ["default"] else f"state {name}", "", joints or "no joints"
        yield "point", "", "[" + ", ".join(f"{x:g}" for x in state["point"]) + "] m in the frame of the flange"
        for key, count in state["spheres"].items():
            yield f"set {key}", "", f"{count} spheres, {state['protrusion_mm'][key]:.1f} mm of protrusion at most"
        yield "cover", "", f"proved, {state['uncovered_mm']:g} mm uncovered"
        for note in state["notes"]:
            yield "note", "dim", note
    if found["replaced"]:
        yield "replaced", "", "the tool of this name that was in the folder"
    yield "folder", "", found["folder"] + (" (from the cache)" if from_cache else "")
