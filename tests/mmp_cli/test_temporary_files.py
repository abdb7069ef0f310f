"""Temporary files are removed after an interruption at any instant."""

import os
import signal
import subprocess
import sys

import pytest

ENDS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}
COMMAND = """
import signal, sys
from mmp_cli import machine, main
from mmp_env.files import temporaries
from mmp_env.files import writing

signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup shuts it off

def version():
    with writing.whole_file("plan.json") as temporary:
        temporary.write_text("half")
        signal.raise_signal(signal.{name})

def interrupted_removal(path):
    signal.raise_signal(signal.{name})

def version_of_which_the_removal_is_interrupted():
    remove, temporaries._remove = temporaries._remove, interrupted_removal
    try:
        writing.check_writable("plan.json")
    finally:
        temporaries._remove = remove

machine.version = {version}
sys.argv = ["mmp", "--version"]
sys.exit(main.main())
"""


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("version", ["version", "version_of_which_the_removal_is_interrupted"])
def test_no_file_stays_after_a_signal(tmp_path, name, version):
    program = COMMAND.format(name=name, version=version)
    ran = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    said = "interrupted" if name == "SIGINT" else f"ended by {name}"
    assert (ran.returncode, ran.stdout, ran.stderr) == (ENDS[name], "", f"mmp: {said}\n")
    assert os.listdir(tmp_path) == []


def test_a_program_that_uses_the_library_leaves_none_at_its_end(tmp_path):
    program = (
        "from mmp_env.files import temporaries, writing\nfrom pathlib import Path\n"
        "context = temporaries.beside(Path('plan.json').absolute())\ncontext.__enter__().touch()\n"
        "temporaries._remove, remove = (lambda path: None), temporaries._remove\ndel context\n"
        "temporaries._remove = remove\nimport os; assert len(os.listdir()) == 1"
    )
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True)
    assert os.listdir(tmp_path) == []


def test_a_signal_that_the_caller_has_shut_off_ends_nothing(tmp_path):
    program = (
        "import signal, sys\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\nfrom mmp_cli import machine, main\n"
        "machine.version = lambda: signal.raise_signal(signal.SIGHUP) or 'told'\n"
        "sys.argv = ['mmp', '--version']\nsys.exit(main.main())"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "mmp-env told\n", "")


def test_the_handlers_are_left_as_they_were(mmp):
    before = [signal.getsignal(signum) for signum in (signal.SIGTERM, signal.SIGHUP)]
    mmp("--version")
    assert [signal.getsignal(signum) for signum in (signal.SIGTERM, signal.SIGHUP)] == before
