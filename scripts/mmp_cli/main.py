"""The console script `mmp`: it runs a command and turns misuse into one sentence and an exit code.

Exit codes: 0: done; 1: no plan in time, a violation, a goal not reached, a planner that failed; 2: bad usage or input,
output that cannot be written, or too little memory; 130: interrupted; 129 and 143: ended by SIGHUP and SIGTERM; 141:
the reader of the output has gone. Any other exception is a fault of the program and keeps its traceback.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # before the signal handler is installed, no slow module is imported, `typing` included
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import NoReturn

COMMANDS = {
    "plan": "plan one instance, check the plan and print a summary",
    "run": "plan many jobs, each arm in its own time, and check the schedule",
    "check": "check plan and schedule files again, on their own",
    "export": "write a plan in another format",
    "show": "open a recording, a plan or a benchmark folder",
    "report": "table and figures of a benchmark folder",
    "bench": "run many instances through several planners",
    "dataset": "write expert episodes of the environment, for learning",
    "robot": "add a robot from URDF or MJCF, show it, or check it",
    "tool": "add a gripper from URDF or MJCF",
    "list": "list robots, tools, cells, tasks and planners with their options",
}
INTERRUPTED = 130
ENDED = (129, INTERRUPTED, 143)
"""Exit codes after SIGHUP, SIGINT and SIGTERM: 128 plus the number of the signal."""
UNREAD = 141
"""Exit code if the reader of the output has gone, as after SIGPIPE."""
_HELP = """usage: mmp COMMAND ...

Collision-free motions for crowded robot-arm cells, found and proved.

commands:
{commands}

`mmp COMMAND --help` lists the options of a command; `mmp --version` prints the version.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs a command line, by default that of the process, and returns its exit code."""
    try:
        from mmp_cli.import_guard import guarded_imports, ignore_interrupts

        with guarded_imports():
            if argv is not None:
                return _run_with_output(list(argv))
            code = _run_process()
            ignore_interrupts()  # the exit handlers of modules must not be interrupted
            return code
    except KeyboardInterrupt as interrupt:
        from mmp_cli.import_guard import describe_interrupt, signal_of

        print(f"mmp: {describe_interrupt(interrupt)}", file=sys.stderr, flush=True)
        return 128 + signal_of(interrupt)
    except Exception as error:
        reason = _out_of_memory(error)
        if reason is None:
            raise
        print(f"mmp: {reason}", file=sys.stderr, flush=True)
        return 2


def run_script(script: Callable[[], int | None]) -> NoReturn:
    """Runs a script beside `mmp` and ends the process with its exit code, or with one sentence and 2 for `MmpError`."""
    from mmp_cli.output import complain
    from mmp_env.errors import MmpError

    try:
        sys.exit(script())
    except MmpError as error:
        complain(error, program=sys.argv[0].rpartition("/")[2])
        sys.exit(2)


def _out_of_memory(error: Exception) -> str | None:
    """Returns the sentence for too little memory, or None for another error.

    It imports nothing: an import that got no memory leaves packages that cannot be imported again.
    """
    errors = sys.modules.get("mmp_env.errors")
    if errors is None:
        return "there is not enough memory to start" if isinstance(error, MemoryError) else None
    return errors.NO_MEMORY if errors.is_out_of_memory(error) else None


def _run_process() -> int:
    from mmp_cli.output import guard_streams

    guard_streams()
    code = _run_with_output(sys.argv[1:])
    if code in ENDED:
        from mmp_cli.import_guard import end_at_once

        sys.stderr.flush()
        # Shutting the interpreter down with MuJoCo loaded takes longer than a user who pressed Ctrl-C wants to wait.
        end_at_once(code)
    return code


def _run_with_output(argv: list[str]) -> int:
    """Runs a command line. Standard output may be full or closed, or its reader may have gone."""
    from mmp_cli.output import OutputError, complain, forget_output

    try:
        code = _run_with_errors(argv)
        sys.stdout.flush()
    except OutputError as error:
        forget_output()
        if error.is_unread:
            return UNREAD
        complain(f"the output cannot be written: {error}")
        return 2
    return code


def _run_with_errors(argv: list[str]) -> int:
    from mmp_cli.output import complain

    try:
        return _run(argv)
    except SystemExit:  # after --help
        sys.stdout.flush()
        raise
    except KeyboardInterrupt as interrupt:
        from mmp_cli.import_guard import describe_interrupt, signal_of

        complain(describe_interrupt(interrupt))
        return 128 + signal_of(interrupt)
    except ValueError as error:
        from mmp_env.errors import MmpError

        if not isinstance(error, MmpError):
            raise
        complain(error)
        return 2


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
    import importlib

    command = importlib.import_module(f"mmp_cli.{argv[0]}")
    return command.run(command.parser().parse(argv[1:]))
