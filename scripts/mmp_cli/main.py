"""The console script `mmp`: finds the command, and turns misuse into one sentence and an exit code.

Exit 0: done; 1: no plan in time, a violation, a goal not reached, a planner that failed; 2: bad usage or bad input;
130: interrupted. Any other exception is a fault of the program and keeps its traceback.
"""

from __future__ import annotations

import errno
import importlib
import os
import sys
from collections.abc import Sequence

COMMANDS = {
    "plan": "plan one instance, check the plan and print a summary",
    "check": "check plan files again, on their own",
    "export": "write a plan in another format",
    "show": "open a recording, a plan or a benchmark folder",
    "report": "table and figures of a benchmark folder",
    "bench": "run many instances through several planners",
    "list": "list robots, cells, tasks and planners with their options",
}
INTERRUPTED = 130
_HELP = """usage: mmp COMMAND ...

Collision-free motions for crowded robot-arm cells, found and proved.

commands:
{commands}

`mmp COMMAND --help` lists the options of a command; `mmp --version` prints the version.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command line, that of the process by default, and returns its exit code."""
    code = _guarded(list(sys.argv[1:] if argv is None else argv))
    if code == INTERRUPTED and argv is None:
        # Taking the interpreter down with MuJoCo loaded takes longer than anybody who pressed Ctrl-C wants to wait.
        sys.stdout.flush()
        os._exit(code)
    return code


def _guarded(argv: list[str]) -> int:
    try:
        code = _run(argv)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("mmp: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        _forget_output()  # whoever read it has gone
        return 1
    except OSError as error:
        if error.errno != errno.ENOSPC or error.filename is not None:  # files of ours are named in what they raise
            raise
        _forget_output()
        print(f"mmp: the output cannot be written: {error.strerror}", file=sys.stderr)
        return 2
    except ValueError as error:
        from mmp_env.errors import MmpError

        if not isinstance(error, MmpError):
            raise
        print(f"mmp: {one_line(error)}", file=sys.stderr)
        return 2
    return code


def _forget_output() -> None:
    """What is still to be said, even at exit, goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def one_line(error: BaseException | str) -> str:
    """The message without line breaks and control characters, which names in a file may hold."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(str(error).split()))


def _run(argv: list[str]) -> int:
    if not argv or argv[0] in ("-h", "--help"):
        width = max(map(len, COMMANDS))
        commands = "\n".join(f"  {name:{width}}  {summary}" for name, summary in COMMANDS.items())
        print(_HELP.format(commands=commands), end="", file=sys.stdout if argv else sys.stderr)
        return 0 if argv else 2
    if argv[0] == "--version":
        from mmp_cli.machine import version

        print(f"mmp-env {version()}")
        return 0
    if argv[0] not in COMMANDS:
        from mmp_env.errors import UnknownNameError

        raise UnknownNameError("command", argv[0], COMMANDS)
    command = importlib.import_module(f"mmp_cli.{argv[0]}")
    return command.run(command.parser().parse(argv[1:]))
