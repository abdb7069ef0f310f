"""Command-line arguments. Every mistake becomes one sentence; a misspelt option comes with the nearest existing one."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.paths import is_file, real_path

LARGEST_SEED = 2**63 - 1
DEFAULT_TIME_LIMIT_S = 60.0
_LARGEST_COUNT = 10**9 - 1


class Parser(argparse.ArgumentParser):
    """An argument parser that raises `MmpError` instead of printing its usage and exiting."""

    def __init__(
        self,
        prog: str,
        description: str | None,
        formatter_class: type[argparse.HelpFormatter] = argparse.HelpFormatter,
    ) -> None:
        super().__init__(prog=prog, description=description, formatter_class=formatter_class, allow_abbrev=False)
        self.register("action", None, _Once)
        self.given = set[str]()

    def parse(self, argv: Sequence[str] | None = None) -> argparse.Namespace:
        """Returns the arguments, by default those of the process. Raises `MmpError`."""
        self.given.clear()
        args, extra = self.parse_known_args(argv)
        for word in extra:
            if word.startswith("-"):
                options = [option for action in self._actions for option in action.option_strings]
                raise UnknownNameError(f"option of {self.prog}", word.partition("=")[0], options)
        if extra:
            raise MmpError(f"{self.prog} has no use for the argument '{extra[0]}'; see {self.prog} --help")
        for action in self._actions:
            value = getattr(args, action.dest, None)
            if value == "" or (isinstance(value, list) and "" in value):  # an unset shell variable
                name = action.option_strings[0] if action.option_strings else action.metavar
                raise MmpError(f"argument {name} is empty; give a value")
        return args

    def error(self, message: str) -> NoReturn:
        """Raises the message as an `MmpError`."""
        raise MmpError(message.replace("ignored explicit argument", "it takes no value, not"))


class _Once(argparse.Action):
    """Stores the value of an argument and refuses an option that is given twice."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        assert isinstance(parser, Parser)
        if option is not None:
            if option in parser.given:
                parser.error(f"{option} is given twice; give it once")
            parser.given.add(option)
        setattr(namespace, self.dest, values)


def seed(text: str) -> int:
    """Returns a whole number from 0."""
    return _whole(text, 0, LARGEST_SEED)


def whole(text: str) -> int:
    """Returns a whole number from 1."""
    return _whole(text, 1, _LARGEST_COUNT)


def whole_or_zero(text: str) -> int:
    """Returns a whole number from 0, for counts that may be 0."""
    return _whole(text, 0, _LARGEST_COUNT)


def positive(text: str) -> float:
    """Returns a finite number above 0."""
    value = _number(text)
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number above 0")
    return value


def margins(text: str) -> dict[str, float]:
    """Returns kind of margin -> metres, from one number for arms and obstacles or from `arms=A,obstacles=B,self=C`."""
    from mmp_env.model.margins import asked_margins

    out: dict[str, float] = {}
    for part in text.split(",") if "=" in text else ():
        kind, _, value = (word.strip() for word in part.partition("="))
        if kind in out:
            raise argparse.ArgumentTypeError(f"'{text}' gives {kind} twice; give one")
        out[kind] = _metres(value, text)
    try:
        return asked_margins(out or _metres(text, text))
    except MmpError as error:  # argparse drops the message of a ValueError
        raise argparse.ArgumentTypeError(str(error)) from None


def _metres(number: str, text: str) -> float:
    """Returns a length in the `text` of a margin."""
    value = _number(number)
    if not (math.isfinite(value) and value > 0):
        allowed = "metres, a finite number above 0 such as 0.005, or arms=A,obstacles=B,self=C with such numbers"
        raise argparse.ArgumentTypeError(f"'{text}' is no margin; it must be {allowed}")
    return value


def add_margin(parser: Parser) -> None:
    """Adds the option for the clearances that plans keep."""
    help = "clearance [m] between arms and to obstacles, or arms=A,obstacles=B,self=C; kept at every instant or refused"
    drawn = "start and goal of a seed are the same for every margin"
    parser.add_argument(
        "--margin",
        type=margins,
        metavar="M",
        help=f"{help}; {drawn}; default: 0.002, less for a tight start or goal",
    )


def prefixes(text: str) -> dict[str, str]:
    """Returns arm name -> prefix of its joints' names, from `left=l_,right=r_`."""
    out: dict[str, str] = {}
    for part in text.split(","):
        name, _, prefix = (word.strip() for word in part.partition("="))
        if not name or "=" not in part:
            raise argparse.ArgumentTypeError(f"'{text}' is not of the form name=prefix,name=prefix")
        if not prefix:
            raise argparse.ArgumentTypeError(
                f"'{text}' gives arm {name} no prefix; name one that its joints begin with"
            )
        if name in out:
            raise argparse.ArgumentTypeError(f"'{text}' gives arm {name} twice; give it once")
        out[name] = prefix
    return out


def environment_id(text: str) -> str:
    """Returns an environment id."""
    from mmp_env.gym.registration import CELLS

    if text not in CELLS:
        raise argparse.ArgumentTypeError(str(UnknownNameError("environment id", text, CELLS)))
    return text


def output(text: str) -> str:
    """Returns the name of an output file or folder; `-` is refused."""
    if text == "-":
        raise argparse.ArgumentTypeError("'-' does not stand for standard output here; give a name")
    return text


def seconds(text: str) -> float:
    """Returns a time above 0 [s]; `inf` means no limit."""
    value = _number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds above 0")
    return value


def setting(text: str) -> tuple[str, Any]:
    """Returns key and value of `key=value`; the value is a JSON number, true, false or null, otherwise text."""
    key, equals, value = text.partition("=")
    if not (key and equals):
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form key=value")
    try:
        parsed = json.loads(value, parse_constant=_refuse)
    except ValueError:
        parsed = value
    return key.replace("-", "_"), value if isinstance(parsed, dict | list) else parsed


def check_spared(source: str, option: str, path: str | Path) -> None:
    """Raises `MmpError` if the output `path` of `option` is the input file `source`.

    A `source` may also be the name of a cell or an environment, which is no file.
    """
    if is_file(source) and real_path(path) == real_path(source):
        raise MmpError(f"{option} would overwrite {source} itself; give another name")


def add_source(parser: Parser) -> None:
    """Adds the arguments that choose an instance; see `mmp_cli.instance_source`."""
    what = "environment id, instance file or cell file (JSON or YAML), or a MuJoCo model (MJCF or URDF)"
    parser.add_argument("source", metavar="SOURCE", help=what)
    help = "arms of a model by prefixes of their joints' names, such as left=l_,right=r_; default: all chains"
    parser.add_argument("--arms", type=prefixes, metavar="NAME=PREFIX,...", help=help)
    parser.add_argument("--instance", metavar="NAME", help="instance of an instance file; default: its first")
    parser.add_argument("--robot", metavar="NAME", help="robot of an environment id; default: ur5e")
    parser.add_argument("--task", metavar="NAME", help="task to draw the instance from; default: reach")
    parser.add_argument(
        "--seed", type=seed, default=0, metavar="N", help="seed of the planner and of the instance; default: 0"
    )
    help = (
        "configurations '{\"left\": [0, ...], ...}' [rad], home, tucked or tool poses; 'left=[0, ...]', perhaps several"
        " times; home or tucked for all arms; or @FILE (JSON or YAML)"
    )
    parser.add_argument("--start", action="append", metavar="JSON", help=help)
    help = "like --start, also stay and any of several; an arm that is left out stays at its start"
    parser.add_argument("--goal", action="append", metavar="JSON", help=help)
    help = "angles of configurations in --start and --goal are in degrees; slides stay in metres"
    parser.add_argument("--degrees", action="store_true", help=help)
    bound = """'left={"upright": {"axis": [0, 0, 1], "within": 0.2}}'"""
    help = (
        f"hold tool axes upright within an angle [rad]: {bound}, perhaps several times, or an object of all, or @FILE"
    )
    parser.add_argument("--keep", action="append", metavar="NAME=JSON", help=help)
    add_margin(parser)


RETIMING = ("max_acceleration", "max_jerk", "rate", "tolerance")
"""Options of retiming, the keywords of `mmp_env.retime`."""


def add_retiming(parser: Parser, when: str) -> None:
    """Adds the options of retiming; `when` says what retimes without being asked."""
    help = f"smooth the plan and keep acceleration and jerk limits; default: {when}"
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--retime", action="store_true", default=None, help=help)
    either.add_argument("--no-retime", action="store_false", dest="retime", default=None, help="keep the plan as it is")
    parser.add_argument("--max-acceleration", type=positive, metavar="A", help="[rad/s^2]; default: the robots' own")
    parser.add_argument("--max-jerk", type=positive, metavar="J", help="[rad/s^3]; default: the robots' own")
    parser.add_argument(
        "--rate", type=positive, metavar="HZ", help="samples per second of a retimed plan; default: 250"
    )
    help = "largest distance of a joint from the path of the plan [rad]; default: 0.05"
    parser.add_argument("--tolerance", type=positive, metavar="RAD", help=help)


def retiming_of(args: argparse.Namespace) -> dict[str, float]:
    """Returns the given options of retiming. Raises `MmpError` for a bad one, or any beside `--no-retime`."""
    given = {name: getattr(args, name) for name in RETIMING if getattr(args, name) is not None}
    if given and not args.retime:
        name = next(iter(given)).replace("_", "-")
        raise MmpError(f"--{name} is for retiming, which does not happen here; give --retime")
    if given:
        from mmp_env.retime.options import RetimeOptions

        RetimeOptions(**given)
    return given


def add_time_limit(parser: Parser, what: str) -> None:
    """Adds the option for the time limit of `what`."""
    help = f"for {what} [s]; default: {DEFAULT_TIME_LIMIT_S:g}"
    parser.add_argument("--time-limit", type=seconds, default=DEFAULT_TIME_LIMIT_S, metavar="S", help=help)


def _refuse(constant: str) -> NoReturn:
    raise ValueError(constant)


def _whole(text: str, least: int, most: int) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 20 and least <= int(text) <= most):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {least} to {most}")
    return int(text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
