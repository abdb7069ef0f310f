"""`mmp robot add|show|check`: imports an arm from URDF or MJCF, makes a picture of a robot, or tests its folder."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from typing import Any

from mmp_cli.arguments import Parser
from mmp_cli.import_progress import ImportProgress
from mmp_cli.output import printable, say
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.wording import counted

_ACTIONS = {
    "add": "import an arm from a URDF or MJCF file",
    "show": "make a picture of a robot's geometry beside its spheres",
    "check": "test a robot's files",
}
_HELP = """usage: mmp robot {add,show,check} ...

Brings an arm of your own: its file becomes a robot that every command takes by name.

commands:
%s

`mmp robot COMMAND --help` lists the options of a command.
"""


class _Robot:
    """The parser of the command, which chooses that of the action."""

    def parse(self, argv: list[str]) -> Namespace:
        """Returns the arguments with the function `act` that runs the action. Raises `MmpError`."""
        if not argv or argv[0] in ("-h", "--help"):
            print(_overview(), end="", file=sys.stdout if argv else sys.stderr)
            raise SystemExit(0 if argv else 2)
        if argv[0] not in _ACTIONS:
            raise UnknownNameError("command of mmp robot", argv[0], _ACTIONS)
        parser, act = {"add": (_add_parser, _add), "show": (_show_parser, _show), "check": (_check_parser, _check)}[
            argv[0]
        ]
        args = parser().parse(argv[1:])
        args.act = act
        return args

    def format_help(self) -> str:
        """Returns the help of the command and of all actions."""
        return "\n".join(
            [_overview(), *(parser().format_help() for parser in (_add_parser, _show_parser, _check_parser))]
        )


def _overview() -> str:
    return _HELP % "\n".join(f"  {name:5}  {summary}" for name, summary in _ACTIONS.items())


def parser() -> Any:
    """The arguments of the command."""
    return _Robot()


def run(args: Namespace) -> int:
    """Runs the command."""
    act: Callable[[Namespace], int] = args.act
    return act(args)


def _add_parser() -> Parser:
    out = Parser("mmp robot add", "Imports the arm in a URDF or MJCF file as a robot folder.")
    out.add_argument("source", metavar="SOURCE", help="a .urdf or .xml file")
    out.add_argument("--name", required=True, help="name of the robot")
    out.add_argument("--root", metavar="BODY", help="body that the arm stands with; by default the outermost one")
    out.add_argument("--tip", metavar="BODY_OR_SITE", help="end of the arm; by default that of the longest chain")
    out.add_argument("--tool", metavar="BODY", help="body of the last link whose frame is the tool point")
    out.add_argument("--prefix", metavar="P", help="use only joints whose names begin so")
    out.add_argument(
        "--package-dir", metavar="DIR", action="append", default=[], help="where packages of package:// paths are"
    )
    out.add_argument("--out", metavar="DIR", help="folder for the robot's folder; by default the user's data folder")
    out.add_argument("--json", action="store_true", help="print one JSON object")
    return out


def _add(args: Namespace) -> int:
    from mmp_env.importing.chain_choice import ChainOptions
    from mmp_env.importing.robot_folder import ImportOptions, add_robot, summary
    from mmp_env.model.names import NAMES, is_name
    from mmp_env.robot_folders import cache_folder, find_robot, user_folder

    if not is_name(args.name) or args.name.startswith("."):
        raise MmpError(f"--name is {printable(args.name)}; it must be {NAMES}")
    if args.out is None:
        there = find_robot(args.name)
        if there is not None and there.parent != user_folder():
            raise MmpError(f"--name {args.name} is the name of a robot in {there}; choose another")
    options = ImportOptions(
        name=args.name,
        chain=ChainOptions(root=args.root, tip=args.tip, tool=args.tool, prefix=args.prefix),
        package_dirs=tuple(args.package_dir),
    )
    with ImportProgress("mmp robot add") as progress:
        made = add_robot(args.source, args.out or user_folder(), options, cache=cache_folder(), progress=progress)
    found = summary(made.folder) | {"replaced": made.replaced}
    if args.json:
        print(json.dumps(found))
    else:
        from mmp_cli.output import print_rows

        print_rows(_rows(found, made.from_cache))
    return 0


def _rows(found: dict[str, Any], from_cache: bool) -> Iterator[tuple[str, str, str]]:
    yield "robot", "bold", f"{found['name']}: {found['title']}"
    yield "chain", "", f"{counted(found['joints'], 'joint')}, {found['root']} to {found['tip']}"
    yield "joints", "", ", ".join(found["joint_names"])
    if found["held"]:
        yield "held", "", ", ".join(found["held"])
    for name, count in found["spheres"].items():
        yield f"set {name}", "", f"{count} spheres, {found['protrusion_mm'][name]:.1f} mm of protrusion at most"
    yield "cover", "", f"proved, {found['uncovered_mm']:g} mm uncovered"
    for reason in ("adjacent", "always", "never"):
        pairs = [f"{p['a']}-{p['b']}" for p in found["self_pairs_ignored"] if p["reason"] == reason]
        if pairs:
            yield reason, "", ", ".join(pairs)
    for note in found["notes"]:
        yield "note", "dim", note
    if found["replaced"]:
        yield "replaced", "", "the robot of this name that was in the folder"
    yield "folder", "", found["folder"] + (" (from the cache)" if from_cache else "")


def _show_parser() -> Parser:
    out = Parser("mmp robot show", "Makes a picture of a robot: its geometry and its spheres side by side.")
    out.add_argument("name", metavar="NAME", help="name of a robot, or the path of its folder")
    out.add_argument("--image", metavar="FILE", required=True, help="PNG, JPEG or WebP file")
    return out


def _show(args: Namespace) -> int:
    from mmp_env.model.robot_reading import load_robot
    from mmp_env.view.robot_picture import save_robot_picture

    save_robot_picture(load_robot(_given(args.name)), args.image)
    say(args.image)
    return 0


def _check_parser() -> Parser:
    out = Parser("mmp robot check", "Tests a robot's files; exit 0, or 1 and every fault.")
    out.add_argument("name", metavar="NAME", help="name of a robot, or the path of its folder")
    out.add_argument("--json", action="store_true", help="print one JSON object")
    return out


def _check(args: Namespace) -> int:
    from mmp_env.importing.robot_check import check_robot
    from mmp_env.model.description import ROBOT_FILE
    from mmp_env.model.missing_model import no_such_model
    from mmp_env.robot_folders import find_robot, robot_names

    name = _given(args.name)
    folder = find_robot(name)
    if folder is None:
        raise no_such_model("robot", name, robot_names(), ROBOT_FILE)
    with ImportProgress("mmp robot check") as progress:
        report = check_robot(folder, progress)
    if args.json:
        print(json.dumps({"name": folder.name, "folder": str(folder), "valid": not report.faults, **report.fields()}))
    else:
        say(*(report.faults or [f"{folder.name} is valid: {', '.join(report.proved)}", *report.notes]))
    return 1 if report.faults else 0


def _given(name: str) -> str:
    """A name, or the absolute path of a folder that was given with a slash or a dot."""
    from mmp_env.files.paths import is_folder, real_path
    from mmp_env.robot_folders import is_path

    return str(real_path(name)) if is_path(name) or (name in (".", "..") and is_folder(name)) else name
