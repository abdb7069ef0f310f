"""The fault kit: a plan survives each failing call, and the kit finds planted faults."""

import errno
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from faults import __main__ as tool
from faults.commands import COMMANDS
from faults.kit import Kit
from faults.planted import ALLOCATIONS, CALLS, LIBRARY, WRITES, python

import mmp_cli.main
from mmp_env.errors import MmpError
from mmp_env.importing.folder_writing import write_folder

PLANTED = {
    "half_written": ("full", "open('out.json', 'w').write('{\"a\": [1, 2, 3, 4]}')", "half-written out.json"),
    "lost": (
        "error",
        "import contextlib\nwith contextlib.suppress(OSError): open('out.json', 'w').write('{}')",
        "without",
    ),
    "traceback": ("readonly", "open('out.json', 'w').write('{}')", "traceback"),
    "silent": ("full", "import sys\ntry: open('out.json', 'w').write('{}')\nexcept OSError: sys.exit(2)", "a sentence"),
    "leaves": ("error", "open('.mmp-1.tmp', 'w').write('x')\nopen('.mmp-1.tmp', 'w').close()", "left .mmp-1.tmp"),
    "killed": ("kill", "open('out.json', 'w').write('[1, 2, 3, 4]')", "half-written out.json"),
    "half of the output": (
        "pipe",
        "import os\nos.write(1, b'one\\n')\ntry: os.write(1, b'two\\n')\nexcept OSError: pass",
        "exit code 0 without 'two'",
    ),
    "unknown": ("pipe", "open('out.strange', 'w').close()\nprint(1)", "no reader for the suffix"),
    "removes": ("error", "import os\nos.remove('plan.json')\nopen('plan.json', 'x').close()", "lost plan.json"),
    "overwrites": ("error", "open('plan.json', 'w').write('{}')", "changed plan.json"),
    "half in the second run": (
        "kill",
        "import os\ntext = '[1]' if os.path.exists('out.json') else '[1, 2]'\nopen('out.json', 'w').write(text)",
        "then half-written out.json",
    ),
    "leaves in the second run": (
        "kill",
        "import os\nif os.path.exists('a.json'): open('.mmp-2.tmp', 'x').close()\nopen('a.json', 'w').write('{}')",
        "then left .mmp-2.tmp",
    ),
    "adds twice": (
        "kill",
        "open('rows.jsonl', 'a').write('{\"name\": 1}\\n')\nopen('a.json', 'w').write('{}')",
        "then rows.jsonl has 1 2 times",
    ),
    "no sync": (
        "full",
        "import os\nf = os.open('a.json', os.O_CREAT | os.O_WRONLY)\nos.write(f, b'{}')\nos.fsync(f)",
        "traceback: OSError: [Errno 28]",
    ),
    "stops without messages": (
        "stderr",
        "import os, sys\ntry: os.write(2, b'a')\nexcept OSError: sys.exit(2)",
        "exit code 2 instead of 0",
    ),
    "stops where messages are closed": (
        "closed",
        "import os, sys\ntry: os.write(2, b'a')\nexcept OSError: sys.exit(2)",
        "exit code 2 instead of 0",
    ),
    "messages in a file": (
        "closed",
        "import os\nf = os.open('a.md', os.O_CREAT | os.O_WRONLY)\nos.write(f, b'a\\n')\nos.write(2, b'b\\n')",
        "half-written a.md",
    ),
}


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    return Kit(tmp_path_factory.mktemp("faults"))


@pytest.mark.parametrize("kind", ["full", "kill", "memory"])
def test_a_plan_survives_calls_that_fail(kit, kind, tmp_path):
    command = COMMANDS["plan"]
    good = tool.good_run(kit, command, kind, tmp_path / "good")
    assert good.code == 0
    assert good.calls >= 8
    for at in tool.points(good.calls, 4):
        assert tool.tried(kit, command, kind, at, good).faults == []


@pytest.mark.parametrize("planted", PLANTED)
def test_planted_faults_are_found(kit, planted, tmp_path):
    kind, program, fault = PLANTED[planted]
    command = python(program)
    if planted == "adds twice":
        command = replace(command, adds=("rows.jsonl",), done="(?!)")
    good = tool.good_run(kit, command, kind, tmp_path / "good")
    found = [
        each
        for at in range(1 if kind == "closed" else good.calls)
        for each in tool.tried(kit, command, kind, at, good).faults
    ]
    assert any(fault in each for each in found), found


def test_a_file_can_be_cut_where_the_disk_is_full(kit, tmp_path):
    opened = "import os\nf = os.open('out.json', os.O_RDWR | os.O_CREAT)\n"
    command = python(f"{opened}try: os.ftruncate(f, 0)\nexcept OSError: raise SystemExit(9)\nos.write(f, b'[]')")
    good = tool.good_run(kit, command, "full", tmp_path / "good")
    assert good.calls == 3
    assert any("traceback: OSError: [Errno 28]" in each for each in tool.tried(kit, command, "full", 1, good).faults)


def test_a_second_run_after_a_good_one_is_judged(kit, tmp_path):
    program = "import os\ntext = '[]' if os.path.exists('out.json') else '[1]'\nopen('out.json', 'w').write(text)"
    command = python(program)
    good = tool.good_run(kit, command, "error", tmp_path / "good")
    assert tool.repeated(kit, command, good) == ["then half-written out.json: 2 bytes, not the 3 of the good run"]
    command = python("open('out.json', 'w').write('[]')")
    assert tool.repeated(kit, command, tool.good_run(kit, command, "error", tmp_path / "other")) == []


def test_possible_points_faults_and_excused_crashes_are_counted(kit, monkeypatch):
    attempts = {0: tool.Attempt([], excused=True), 1: tool.Attempt(["lost a.json"])}
    monkeypatch.setitem(tool.COMMANDS, "two", python("import os\nfor each in 'abc': os.makedirs(each, exist_ok=True)"))
    monkeypatch.setattr(tool, "tried", lambda kit, command, kind, at, good: attempts.get(at, tool.Attempt([])))
    with ThreadPoolExecutor(1) as pool:
        found = tool.try_command(kit, pool, "two", ["error", "closed"], None)
        assert (found.tried, found.possible) == ({"error": 3, "closed": 1, "again": 1}, 5)
        assert (found.faulty, found.excused) == (1, 2)


def test_the_page_names_the_commands_whose_calls_do_not_all_fail():
    page = (Path(__file__).parents[1] / "docs" / "explanation" / "attacks.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^scripts/faults.sh (plan .*?) +#", page, re.MULTILINE)
    (sentence,) = re.findall(r"The second command leaves out (.*?), which", page)
    assert sorted([*line.split(), *re.findall(r"`(\w+)`", sentence)]) == sorted(COMMANDS)


def test_all_points_or_some_over_all_are_tried():
    assert tool.points(5, None) == [0, 1, 2, 3, 4]
    assert tool.points(100, 4) == [0, 33, 66, 99]
    assert tool.points(3, 1) == [0]


@pytest.mark.parametrize("call", CALLS)
def test_each_call_that_changes_files_fails_on_a_read_only_disk(kit, call, tmp_path):
    command = python(CALLS[call])
    good = tool.good_run(kit, command, "readonly", tmp_path / "good")
    assert (good.code, good.calls) == (0, 1), good.err
    found = tool.tried(kit, command, "readonly", 0, good).faults
    assert any("traceback: OSError: [Errno 30]" in each for each in found), found


@pytest.mark.parametrize("call", WRITES)
def test_writes_to_a_stream_fail(kit, call, tmp_path):
    command = python(WRITES[call])
    good = tool.good_run(kit, command, "full", tmp_path / "good")
    found = tool.tried(kit, command, "full", good.calls - 1, good).faults
    assert any("half-written out.json" in each for each in found), found


@pytest.mark.parametrize("call", ALLOCATIONS)
def test_each_way_to_allocate_fails(kit, call, tmp_path):
    program = f"{LIBRARY}{ALLOCATIONS[call]}\nraise SystemExit(7 if failed else 0)"
    command = python(program)
    good = tool.good_run(kit, command, "memory", tmp_path / "good")
    found = tool.tried(kit, command, "memory", good.calls - 1, good).faults
    assert any("exit code 7" in each for each in found), found


def test_a_temporary_file_may_stay_where_nothing_can_be_removed(kit, tmp_path):
    program = "import os\nopen('.mmp-1.tmp', 'w').close()\ntry: os.unlink('.mmp-1.tmp')\nexcept OSError: pass"
    command = python(program)
    good = tool.good_run(kit, command, "readonly", tmp_path / "good")
    assert tool.tried(kit, command, "readonly", 1, good).faults == []
    assert tool.tried(kit, command, "error", 1, good).faults == ["left .mmp-1.tmp"]


def test_a_temporary_file_whose_removal_failed_is_removed_at_the_end(kit, tmp_path):
    program = "from mmp_env.files.writing import check_writable\ncheck_writable('out.json')"
    command = python(program)
    good = tool.good_run(kit, command, "error", tmp_path / "good")
    assert good.calls == 2
    assert tool.tried(kit, command, "error", 1, good).faults == []


def test_a_folder_that_can_be_neither_replaced_nor_moved_back_is_kept(tmp_path, monkeypatch):
    moves = [os.rename]

    def once(*names):
        if not moves:
            raise OSError(errno.EROFS, "Read-only file system")
        moves.pop()(*names)

    write_folder(tmp_path / "a", {"b.txt": "old"})
    monkeypatch.setattr(os, "rename", once)
    with pytest.raises(MmpError, match=r"the folder that was there is now \S*\.mmp-") as refused:
        write_folder(tmp_path / "a", {"b.txt": "new"})
    assert (Path(str(refused.value).rpartition(" ")[2]) / "b.txt").read_text() == "old"


@pytest.mark.parametrize(
    "error",
    [
        mujoco.FatalError("Could not allocate memory"),
        ValueError("Error: engine error: Could not allocate memory"),
        OSError("codec configuration error when writing image file"),
    ],
)
def test_too_little_memory_is_a_sentence(error, monkeypatch, capsys):
    def no_memory(_):
        raise error

    monkeypatch.setattr(mmp_cli.main, "_run_with_output", no_memory)
    assert mmp_cli.main.main([]) == 2
    assert capsys.readouterr().err == "mmp: there is not enough memory\n"


def test_too_little_memory_while_mmp_is_imported_is_a_sentence():
    program = (
        "import sys, mmp_cli.main as cli\n"
        "class NoMemory:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'gymnasium.utils': raise MemoryError\n"
        "sys.meta_path.insert(0, NoMemory())\n"
        "sys.exit(cli.main(['list']))"
    )
    ran = subprocess.run([sys.executable, "-P", "-c", program], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (2, "", "mmp: there is not enough memory to start\n")


def test_half_of_the_json_is_found(kit, tmp_path):
    program = "import os\nos.write(1, b'{\"a\": 1,')\ntry: os.write(1, b' \"b\": 2}')\nexcept OSError: pass"
    command = python(program, "--json")
    good = tool.good_run(kit, command, "pipe", tmp_path / "good")
    assert tool.tried(kit, command, "pipe", 1, good).faults == ["exit code 0 and half of the JSON"]
