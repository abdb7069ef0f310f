"""Closed, full or unread output: the exit code says so, and says nothing about the plan."""

import os
import shlex
import subprocess
import sys

import pytest
from support import report_folders

from mmp_cli.output import print_rows
from mmp_env.errors import MmpError
from mmp_env.opengl import offscreen_backend

MMP = f'{shlex.quote(sys.executable)} -c "from mmp_cli.main import main; raise SystemExit(main())"'
COMMANDS = {
    "plan": "plan MultiArmCell-2 --planner ecbs",
    "check": "check plan.json",
    "check --json": "check plan.json --json",
    "export": "export plan.json --to plan.csv",
    "show": "show plan.json --image plan.png",
    "report": "report results",
    "bench": "bench MultiArmCell-2 --planners ecbs --count 1 --out bench",
    "list": "list",
    "list --json": "list --json",
    "--version": "--version",
    "--help": "--help",
    "plan --help": "plan --help",
}


@pytest.fixture
def shell(plan, tmp_path):
    """Runs a line of the shell beside a good plan and a folder of results."""
    report_folders.folder_of(tmp_path / "results", [report_folders.line("ring/0", "a")])

    def run(command, redirections):
        line = f"{MMP} {COMMANDS.get(command, command)} {redirections}"
        return subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False)

    return run


@pytest.mark.parametrize("command", COMMANDS)
def test_a_closed_output_is_no_verdict(shell, command):
    if command == "show":
        try:
            offscreen_backend()
        except MmpError as error:
            pytest.skip(str(error))
    ran = shell(command, ">&-")
    assert ran.returncode == 2
    assert ran.stderr.splitlines()[-1] == "mmp: the output cannot be written: standard output is closed"
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("command", ["check", "list", "plan --help"])
def test_a_full_output_is_no_verdict(shell, command):
    ran = shell(command, ">/dev/full")
    assert (ran.returncode, ran.stderr) == (2, "mmp: the output cannot be written: No space left on device\n")


@pytest.mark.parametrize("command", ["check", "list", "plan --help"])
def test_an_output_that_nobody_reads_is_silent_and_no_verdict(shell, command):
    ran = shell(command, "| true; exit ${PIPESTATUS[0]}")
    assert (ran.returncode, ran.stderr) == (141, "")


@pytest.mark.parametrize("closed", ["2>&-", "2>/dev/full", "<&-"])
@pytest.mark.parametrize(("command", "code"), [("check", 0), ("check none.json", 2)])
def test_without_standard_error_the_code_is_the_same(shell, command, code, closed):
    ran = shell(command, closed)
    assert ran.returncode == code
    assert ran.stdout.startswith("plan.json: valid") == (code == 0)


def test_a_file_is_not_written_to_in_place_of_a_closed_output(shell, tmp_path):
    assert shell("export", ">&- 2>&- <&-").returncode == 2
    assert (tmp_path / "plan.csv").read_text().startswith("time,left/joint1")
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".mmp")]


def test_characters_that_the_terminal_lacks_are_written_as_escapes(shell, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "latin-1")
    (tmp_path / "plan.json").rename(tmp_path / "\u03c0.json")
    ran = shell("check *.json", "")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.startswith("\\u03c0.json: valid")


ESCAPES = "a\x1b[2Jb\nc\u202ed\x9be"
SHOWN = "a\\x1b[2Jb\\nc\\u202ed\\x9be"


def spoiled(text):
    """Returns the characters of a text that control a terminal or mislead a reader."""
    return [c for c in text if not c.isprintable() and c != "\n"]


def test_no_name_of_a_file_reaches_the_terminal_raw(mmp, plan, tmp_path):
    strange = plan.rename(tmp_path / f"{ESCAPES}.json")
    to = tmp_path / f"{ESCAPES}.csv"
    for command in (
        ["check", strange],
        ["export", strange, "--no-retime", "--to", to],
        ["check", tmp_path / f"{ESCAPES}.no"],
    ):
        ran = mmp(*command)
        assert "a\\x1b[2Jb" in ran.out + ran.err
        assert (ran.out + ran.err).count("\n") == 1
        assert not spoiled(ran.out + ran.err)


def test_no_word_of_a_planner_reaches_the_terminal_raw(capsys):
    print_rows([(ESCAPES, "bold", f"found by {ESCAPES}")])
    out = capsys.readouterr().out
    assert out == f"{SHOWN}  found by {SHOWN}\n"


def test_no_result_of_a_benchmark_reaches_page_table_or_terminal_raw(mmp, tmp_path, figures_unrendered):
    lines = [
        report_folders.line("ring/0", ESCAPES, "error", message=f"https://a.b @you {ESCAPES}\n# title"),
        report_folders.line(f"ring/{ESCAPES}", "$x^{$", machine=ESCAPES, version=ESCAPES),
    ]
    settings = report_folders.settings(ESCAPES, sources=[f"/{ESCAPES}\n\n# title/x.json"], robot=ESCAPES)
    folder = report_folders.folder_of(tmp_path / "results", lines, settings)
    ran = mmp("report", folder, "--title", ESCAPES)
    assert ran.code == 0
    page, table = ((folder / name).read_text() for name in ("report.html", "table.md"))
    assert not spoiled(page + table + ran.out + ran.err)
    assert SHOWN.replace("\\n", " ") in page
    assert "\n# title" not in table
    assert table.count("\n# ") == 0
    assert "https\\://a.b \\@you" in table
