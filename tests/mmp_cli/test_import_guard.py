"""Ctrl-C while `mmp` imports its modules, and while it ends: exit 130 and one line, with any module."""

import signal
import subprocess
import sys

import pytest

PROGRAM = """
import sys
import mmp_cli.main
mmp_cli.main.COMMANDS["odd"] = "a command with an odd import"
mmp_cli.__path__.append({folder!r})
sys.argv = ["mmp", "odd"]
sys.exit(mmp_cli.main.main())
"""
COMMAND = """
import time
from mmp_cli.arguments import Parser

def parser():
    return Parser("mmp odd", "Waits to be interrupted.")

def run(args):
    time.sleep(10)
    return 1
"""
INTERRUPT = "import signal\nsignal.raise_signal(signal.SIGINT)\nfor _ in range(1000): pass\n"
ACTED = f"exec({INTERRUPT!r})"
IMPORTS = {
    "that lets it pass": INTERRUPT,
    "that makes another error of it": f"try:\n    {ACTED}\nexcept BaseException:\n    raise ImportError('no')\n",
    "that swallows it": f"try:\n    {ACTED}\nexcept BaseException:\n    pass\n",
    "that swallows it in a callback": f"class Odd:\n    def __del__(self):\n        {ACTED}\nOdd()\n",
    "whose class makes another error of it": (
        f"class Name:\n    def __set_name__(self, owner, name):\n        {ACTED}\nclass Odd:\n    name = Name()\n"
    ),
}
"""Source of a module, without the lines that make it a command."""


def ran(tmp_path, module):
    (tmp_path / "odd.py").write_text(module)
    return subprocess.run(
        [sys.executable, "-c", PROGRAM.format(folder=str(tmp_path))], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("kind", IMPORTS)
def test_ctrl_c_in_an_import(tmp_path, kind):
    end = ran(tmp_path, IMPORTS[kind] + COMMAND)
    assert (end.returncode, end.stdout, end.stderr) == (130, "", "mmp: interrupted\n")


def test_ctrl_c_that_is_lost_in_a_callback_later_on(tmp_path):
    callback = f"import time\nclass Odd:\n    def __del__(self):\n        exec({INTERRUPT!r})\n"
    end = ran(tmp_path, callback + COMMAND.replace("    time.sleep", "    Odd()\n    time.sleep"))
    assert (end.returncode, end.stdout, end.stderr) == (130, "", "mmp: interrupted\n")


def test_the_second_ctrl_c_does_not_wait_for_an_import_that_hangs(tmp_path):
    end = ran(tmp_path, INTERRUPT + INTERRUPT + "import time\ntime.sleep(10)\n" + COMMAND)
    assert (end.returncode, end.stdout, end.stderr) == (130, "", "mmp: interrupted\n")


@pytest.mark.parametrize("buffered", [[], ["-u"]])
def test_ctrl_c_while_the_process_ends_changes_nothing(buffered):
    program = (
        "import atexit, signal, sys\nfrom mmp_cli.main import main\n"
        "atexit.register(signal.raise_signal, signal.SIGINT)\nsys.argv = ['mmp', '--version']\nsys.exit(main())"
    )
    end = subprocess.run([sys.executable, *buffered, "-c", program], capture_output=True, text=True, check=False)
    assert (end.returncode, end.stderr) == (0, "")
    assert end.stdout.startswith("mmp-env ")


@pytest.mark.parametrize("buffered", [[], ["-u"]])
def test_the_line_is_printed_whether_python_buffers_or_not(buffered):
    program = (
        "import signal, sys\nimport mmp_cli.main\nfrom mmp_cli import machine\n"
        "machine.version = lambda: signal.raise_signal(signal.SIGINT)\n"
        "sys.argv = ['mmp', '--version']\nsys.exit(mmp_cli.main.main())"
    )
    end = subprocess.run([sys.executable, *buffered, "-c", program], capture_output=True, text=True, check=False)
    assert (end.returncode, end.stdout, end.stderr) == (130, "", "mmp: interrupted\n")


def test_before_the_guard_is_installed_no_slow_module_is_imported():
    program = "import sys; before = set(sys.modules); import mmp_cli.main; print(*sorted(set(sys.modules) - before))"
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert set(out.split()) <= {"__future__", "mmp_cli", "mmp_cli.main"}


def test_the_handler_of_ctrl_c_is_left_as_it_was(mmp):
    before, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    mmp("--version")
    assert signal.getsignal(signal.SIGINT) is before
    assert sys.unraisablehook is hook
