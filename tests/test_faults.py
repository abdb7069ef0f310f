"""The fault kit: a plan survives each failing call, and the kit finds planted faults."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import mujoco
import numpy as np
import pytest
from faults import __main__ as tool
from faults import judges, whole_files
from faults.commands import COMMANDS, Command
from faults.crashes import STACK, crashed_elsewhere
from faults.kit import Kit, Run
from faults.planted import ALLOCATIONS, CALLS, LIBRARY, WRITES

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
}

CRASH_IN = (
    'Fatal Python error: Segmentation fault\n\nCurrent thread 0x1 (most recent call first):\n  File "{}", line 1\n'
)
HANDLER = """/faults/failing_calls.so(+0x1)[0x1]
/usr/lib/libc.so.6(+0x3)[0x3]
/usr/lib/libpython3.11.so.1.0(+0x2)[0x2]
/usr/lib/libc.so.6(+0x3)[0x3]
"""
"""Native frames of a handler of signals, which are before those of the crash."""
NO_MEMORY = "/usr/lib/libpython3.11.so.1.0(_PyErr_NoMemory+0x1a)[0x4]\n"


def _python(program: str, *line: str) -> Command:
    """Returns a command that runs the text of a program."""
    return Command([*line], program=[sys.executable, "-c", program])


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
        assert tool.tried(kit, command, kind, at, good) == []


@pytest.mark.parametrize("planted", PLANTED)
def test_planted_faults_are_found(kit, planted, tmp_path):
    kind, program, fault = PLANTED[planted]
    command = _python(program)
    good = tool.good_run(kit, command, kind, tmp_path / "good")
    found = [each for at in range(good.calls) for each in tool.tried(kit, command, kind, at, good)]
    assert any(fault in each for each in found), found


def test_what_was_reported_and_is_lost_is_found(kit, tmp_path):
    with kit.folder() as (folder, before):
        run = kit.run(_python(""), folder, before)
        kept = {"results/results.jsonl": before["results/results.jsonl"] + b'{"more": 1}\n'}
        assert judges.faults_after(run, run, kept) == ["then lost '{\"more\": 1}' of results/results.jsonl"]


def test_all_points_or_some_over_all_are_tried():
    assert tool.points(5, None) == [0, 1, 2, 3, 4]
    assert tool.points(100, 4) == [0, 33, 66, 99]
    assert tool.points(3, 1) == [0]


@pytest.mark.parametrize("call", CALLS)
def test_each_call_that_changes_files_fails_on_a_read_only_disk(kit, call, tmp_path):
    command = _python(CALLS[call])
    good = tool.good_run(kit, command, "readonly", tmp_path / "good")
    assert (good.code, good.calls) == (0, 1), good.err
    found = tool.tried(kit, command, "readonly", 0, good)
    assert any("traceback: OSError: [Errno 30]" in each for each in found), found


@pytest.mark.parametrize("call", WRITES)
def test_writes_to_a_stream_fail(kit, call, tmp_path):
    command = _python(WRITES[call])
    good = tool.good_run(kit, command, "full", tmp_path / "good")
    found = tool.tried(kit, command, "full", good.calls - 1, good)
    assert any("half-written out.json" in each for each in found), found


@pytest.mark.parametrize("call", ALLOCATIONS)
def test_each_way_to_allocate_fails(kit, call, tmp_path):
    program = f"{LIBRARY}{ALLOCATIONS[call]}\nraise SystemExit(7 if failed else 0)"
    command = _python(program)
    good = tool.good_run(kit, command, "memory", tmp_path / "good")
    found = tool.tried(kit, command, "memory", good.calls - 1, good)
    assert any("exit code 7" in each for each in found), found


def test_a_temporary_file_may_stay_where_nothing_can_be_removed(kit, tmp_path):
    program = "import os\nopen('.mmp-1.tmp', 'x').close()\ntry: os.unlink('.mmp-1.tmp')\nexcept OSError: pass"
    command = _python(program)
    good = tool.good_run(kit, command, "readonly", tmp_path / "good")
    assert tool.tried(kit, command, "readonly", 1, good) == []
    assert tool.tried(kit, command, "error", 1, good) == ["left .mmp-1.tmp"]


def test_a_temporary_file_whose_removal_failed_is_removed_at_the_end(kit, tmp_path):
    program = "from mmp_env.files.writing import check_writable\ncheck_writable('out.json')"
    command = _python(program)
    good = tool.good_run(kit, command, "error", tmp_path / "good")
    assert good.calls == 2
    assert tool.tried(kit, command, "error", 1, good) == []


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
    command = _python(program, "--json")
    good = tool.good_run(kit, command, "pipe", tmp_path / "good")
    assert tool.tried(kit, command, "pipe", 1, good) == ["exit code 0 and half of the JSON"]


def _run(folder: Path, **values) -> Run:
    command = values.pop("command", Command([]))
    fields = {"code": 0, "out": "", "err": "", "calls": 0, "before": {}} | values
    return Run(command=command, folder=folder, **fields)


def test_units_and_files_that_were_reported_and_are_not_there_are_found(tmp_path):
    good, folder = tmp_path / "good", tmp_path / "run"
    good.mkdir()
    folder.mkdir()
    (good / "out.json").write_text("{}")
    (folder / "rows.jsonl").write_text("{}\n")
    command = Command([], adds=("rows.jsonl",), done=r"^(\d+) of \d+ done")
    run = _run(folder, command=command, code=-signal.SIGKILL, err="1 of 3 done\n2 of 3 done\n", out="file out.json\n")
    found = judges.faults_of(run, "kill", _run(good))
    assert found[-2:] == ["reported out.json, which is not there", "reported 2 done, and rows.jsonl has 1"]


def test_only_crashes_of_other_libraries_without_memory_are_waived(tmp_path):
    native = CRASH_IN.format("/site/mmp_env/x.py") + f"{STACK}\n{HANDLER}"
    python = "/usr/bin/python3.11(PyObject_Call+0x1)[0x4]\n"
    crash = {
        "/usr/lib/libgallium-22.so(+0x1)[0x1]\n/site/mujoco/libmujoco.so.3(mjr_makeContext+0x5)[0x5]\n" + python: True,
        "/site/scipy/spatial/_qhull.cpython-311-x86_64-linux-gnu.so(+0x1)[0x1]\n" + python: True,
        "/site/mmp_env/_core_v3.so(+0x1)[0x1]\n/usr/lib/libGL.so.1(+0x1)[0x1]\n" + python: False,
        "/site/mujoco/libmujoco.so.3(mj_step+0x5)[0x5]\n" + python: False,
        "/site/numpy/_core.so(+0x1)[0x1]\n" + python + "/usr/lib/libgallium-22.so(+0x1)[0x1]\n": False,
        NO_MEMORY + "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + python: True,
        NO_MEMORY + "/site/mmp_env/_core_v3.so(+0x1)[0x1]\n" + python: False,
        python + "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + python: False,
        "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + NO_MEMORY: False,
    }
    for frames, waived in crash.items():
        assert crashed_elsewhere(_run(tmp_path, code=-signal.SIGSEGV, err=native + frames)) == waived, frames
    drawing = tmp_path / "drawing.py"
    drawing.write_text("    mujoco.mjr_render(rectangle, scene, context)\n")
    files = {"/site/mujoco/egl/__init__.py": True, "/site/mmp_env/view/films.py": False, str(drawing): True}
    for file, waived in files.items():
        other = CRASH_IN.format("/site/mujoco/egl/__init__.py").replace("Current thread", "Thread")
        err = f"{other}\n{CRASH_IN.format(file)}"
        assert crashed_elsewhere(_run(tmp_path, code=-signal.SIGABRT, err=err)) == waived, file


def test_a_crash_has_its_native_stack(kit):
    with kit.folder() as (folder, before):
        command = _python("import ctypes; ctypes.string_at(0)")
        run = kit.run(command, folder, before, "memory")
        assert run.code == -signal.SIGSEGV
        assert STACK in run.err
        assert "Current thread" in run.err
        assert "_ctypes" in run.err.partition(STACK)[2]
        assert not crashed_elsewhere(run)


def test_only_the_traceback_of_a_failed_import_of_numpy_is_waived(tmp_path):
    run = _run(tmp_path, code=3, err=f"Traceback\n{judges.EXTENSION}")
    assert [each.split(":")[0] for each in judges.faults_of(run, "memory", run)] == ["exit code 3"]


@pytest.mark.parametrize(
    ("kind", "code", "err", "found"),
    [
        ("pipe", 141, "", []),
        ("error", 141, "mmp: a sentence", ["exit code 141: mmp: a sentence"]),
        ("memory", 1, "mmp plan: error: a sentence", []),
        ("memory", 1, "", ["exit code 1 without a sentence"]),
        ("kill", 1, "", ["exit code 1 without a sentence"]),
        ("full", 1, "mmp: a sentence", ["exit code 1: mmp: a sentence"]),
        ("full", 2, "mmp: a sentence", []),
    ],
)
def test_each_kind_allows_its_exit_codes_alone(kind, code, err, found, tmp_path):
    run = _run(tmp_path, code=code, err=err)
    assert judges.faults_of(run, kind, run) == found


def test_a_file_of_an_unknown_kind_is_refused(tmp_path):
    (tmp_path / "a.strange").touch()
    assert whole_files.broken(tmp_path / "a.strange") == "no reader for the suffix '.strange'"


def test_a_damaged_dataset_that_is_not_the_first_of_its_file_is_found(tmp_path):
    path = tmp_path / "main_data.hdf5"
    with h5py.File(path, "w") as file:
        file["a"] = np.zeros(3)
        file.create_dataset("b", data=np.arange(5000), compression="gzip", fletcher32=True)
        place = file["b"].id.get_chunk_info(0).byte_offset
    assert whole_files.broken(path) is None
    content = bytearray(path.read_bytes())
    content[place + 9] ^= 255
    path.write_bytes(content)
    assert "OSError" in str(whole_files.broken(path))
