"""The judges of the fault kit find planted faults."""

import json
import signal
import struct
from dataclasses import replace

import h5py
import imageio_ffmpeg
import numpy as np
import pytest
from faults import judges, whole_files
from faults.commands import COMMANDS, Command
from faults.planted import made_run
from PIL import Image


def test_units_and_files_that_were_reported_and_are_not_there_are_found(tmp_path):
    good, folder = tmp_path / "good", tmp_path / "run"
    good.mkdir()
    folder.mkdir()
    (good / "out.json").write_text("{}")
    (folder / "rows.jsonl").write_text("{}\n")
    command = Command([], adds=("rows.jsonl",), done=r"^(\d+) of \d+ done")
    run = made_run(
        folder, command=command, code=-signal.SIGKILL, err="1 of 3 done\n2 of 3 done\n", out="file out.json\n"
    )
    found = judges.faults_of(run, "kill", made_run(good))
    assert found[-2:] == ["reported out.json, which is not there", "reported 2 done, and rows.jsonl has 1"]


def test_only_the_traceback_of_a_failed_import_of_numpy_is_waived(tmp_path):
    run = made_run(tmp_path, code=3, err=f"Traceback\n{judges.EXTENSION}")
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
    run = made_run(tmp_path, code=code, err=err)
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


def _write(folder, files):
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def _judged(tmp_path, left, whole, kind="error", **values):
    """Returns the faults of a run that left some files, where a good run leaves the `whole` ones."""
    good, run = _write(tmp_path / "good", whole), _write(tmp_path / "run", left)
    good.mkdir(exist_ok=True)
    run.mkdir(exist_ok=True)
    return judges.faults_of(made_run(run, **values), kind, made_run(good, command=values.get("command", Command([]))))


OLD, NEW = b'{"tip": "fore"}', b'{"tip": "hand"}'
ROBOT, OTHER = "robots/small/robot.json", "robots/small/hulls.json"
MOVED = "mmp: robots/small cannot be written; the folder that was there is now robots/.mmp-1-a.tmp\n"
KILLED = {"kind": "kill", "code": -signal.SIGKILL}
SAID = {"kind": "readonly", "code": 2, "err": MOVED}
LOST = f"lost {ROBOT}"


@pytest.mark.parametrize(
    ("left", "values", "found"),
    [
        ({"robots/.mmp-1-a.tmp/robot.json": OLD}, KILLED, []),
        ({"robots/.mmp-1-a.tmp/robot.json": OLD[:5]}, KILLED, [LOST]),
        ({"robots/.mmp-1-a.tmp/robot.json": OLD}, KILLED | {"command": COMMANDS["plan"]}, [LOST]),
        ({}, KILLED, [LOST]),
        ({"robots/.mmp-1-a.tmp/robot.json": OLD}, SAID, []),
        ({"robots/.mmp-1-a.tmp/robot.json": OLD[:5]}, SAID, [LOST]),
        ({"robots/.mmp-2-b.tmp/robot.json": OLD}, SAID, ["says robots/.mmp-1-a.tmp, which is not there", LOST]),
        ({"robots/.mmp-1-a.tmp/robot.json": OLD}, SAID | {"err": "mmp: left .mmp-1-a.tmp"}, [LOST]),
    ],
)
def test_a_folder_that_is_replaced_must_be_whole_elsewhere(left, values, found, tmp_path):
    values = {"command": COMMANDS["replace"], "there": {ROBOT: OLD}} | values
    assert _judged(tmp_path, left, {ROBOT: NEW}, **values) == found


def test_a_folder_that_is_half_old_and_half_new_is_found(tmp_path):
    there, whole = {ROBOT: OLD, OTHER: OLD}, {ROBOT: NEW, OTHER: NEW}
    values = {"command": COMMANDS["replace"], "there": there} | KILLED
    assert _judged(tmp_path / "old", there, whole, **values) == []
    assert _judged(tmp_path / "new", whole, whole, **values) == []
    found = _judged(tmp_path / "both", there | {ROBOT: NEW}, whole, **values)
    assert found == ["robots/small is neither the old nor the new folder"]


def test_results_that_a_killed_run_removes_are_found(tmp_path):
    there = {"bench/results.jsonl": b'{"instance": "a"}\n'}
    assert _judged(tmp_path, {}, there, command=COMMANDS["grow"], there=there, **KILLED) == ["lost bench/results.jsonl"]


def _box(kind, content):
    return struct.pack(">I4s", 8 + len(content), kind) + content


def _arrays(path, **arrays):
    np.savez(path, **arrays)
    return path.read_bytes()


FILM = _box(b"ftyp", b"isom") + _box(b"moov", b"index") + _box(b"mdat", b"frames")
WHOLE = {
    "plan-out.json": (b'{"schema": "mmp-plan/1", "positions": [[0, 1], [1, 2]]}', b"{}"),
    "rows of out.csv": (b"t,a\n0,1\n1,2\n2,3\n", b"t,a\n0,1\n"),
    "out.yaml": (b"names: [a]\npoints:\n- 1\n- 2\n- 3\n", b"names: [a]\npoints:\n- 1\n"),
    "film.mp4": (FILM, b"moovmdat"),
    "shorter.mp4": (FILM, FILM[:-14] + _box(b"mdat", b"frame")),
    "cut.mp4": (FILM, FILM[:-3]),
    "tree.svg": (b"<svg><g/><g/></svg>", b"<svg><g/></svg>"),
    "table.md": (b"| a |\n| 1 |\n", b"| a |\n"),
}


@pytest.mark.parametrize("code", [0, 2])
@pytest.mark.parametrize("name", WHOLE)
def test_a_file_that_is_less_than_that_of_the_good_run_is_found(name, code, tmp_path):
    whole, half = WHOLE[name]
    file = name.split()[-1]
    values = {"code": code, "err": "mmp: a sentence"}
    assert _judged(tmp_path / "whole", {file: whole}, {file: whole}, **values) == []
    found = _judged(tmp_path / "half", {file: half}, {file: whole}, **values)
    assert [each.split(":")[0] for each in found] == [f"half-written {file}"]


def test_only_numbers_may_differ_in_a_file_with_times(tmp_path):
    whole, other, half = (f"<svg>{text}</svg>".encode() for text in ("<g>1.5 s</g>", "<g>2 s</g>", "<g>1.5</g>"))
    name, values = "tree.svg", {"command": COMMANDS["plan"], "code": 2, "err": "mmp: a sentence"}
    assert _judged(tmp_path / "other", {name: other}, {name: whole}, **values) == []
    assert len(_judged(tmp_path / "half", {name: half}, {name: whole}, **values)) == 1
    assert len(_judged(tmp_path / "plan", {name: other}, {name: whole}, **values | {"command": Command([])})) == 1


def test_a_file_that_the_good_run_does_not_write_is_found(tmp_path):
    assert _judged(tmp_path, {"a.json": b"{}"}, {}) == ["wrote a.json, which is not there in the good run"]


def _row(planner, **more):
    return json.dumps({"instance": "a", "planner": planner, "seed": 0, "status": "solved", "cost_rad": 1.0} | more)


@pytest.mark.parametrize(
    ("rows", "kind", "code", "found"),
    [
        ([_row("x", cost_rad=2.0), _row("y")], "error", 0, []),
        ([_row("x")], "error", 2, []),
        ([_row("x")], "error", 0, ["exit code 0 without a y 0 in rows.jsonl"]),
        ([_row("x"), _row("x"), _row("y")], "error", 0, ["rows.jsonl has a x 0 2 times"]),
        ([_row("x"), _row("z")], "error", 2, ["rows.jsonl has a z 0, which is strange"]),
        (['{"instance": "a", "planner": "x", "seed": 0}'], "error", 2, ["half-written rows.jsonl"]),
        ([_row("x", status="error"), _row("y")], "error", 0, ["half-written rows.jsonl"]),
        ([_row("x", status="error"), _row("y")], "memory", 0, []),
        (["1"], "error", 2, ["half-written rows.jsonl"]),
    ],
)
def test_rows_that_are_missing_strange_or_incomplete_are_found(rows, kind, code, found, tmp_path):
    command = Command([], adds=("rows.jsonl",), done="(?!)")
    left, whole = ("".join(f"{row}\n" for row in each).encode() for each in (rows, [_row("x"), _row("y")]))
    values = {"command": command, "code": code, "err": "mmp: a sentence"}
    assert [
        each.split(":")[0] for each in _judged(tmp_path, {"rows.jsonl": left}, {"rows.jsonl": whole}, kind, **values)
    ] == found


def test_a_torn_last_row_is_found_after_exit_code_0(tmp_path):
    command = Command([], adds=("rows.jsonl",), done="(?!)")
    whole = f"{_row('x')}\n".encode()
    left = {"rows.jsonl": whole + b'{"instance"'}
    values = {"command": command, "err": "mmp: a sentence"}
    assert _judged(tmp_path / "2", left, {"rows.jsonl": whole}, code=2, **values) == []
    found = _judged(tmp_path / "0", left, {"rows.jsonl": whole}, **values)
    assert found == ["half-written rows.jsonl: no end of the last line"]


def test_entries_of_an_index_and_its_settings_must_be_those_of_the_good_run(tmp_path):
    command, name = COMMANDS["dataset"], "data/dataset.json"
    entries = [{"name": each, "seed": 0, "outcome": "success", "steps": 3} for each in "ab"]
    whole = {"settings": {"seed": 0}, "instances": entries}
    damaged = {
        "[]": [],
        "settings": {"settings": {}, "instances": entries},
        "steps": {**whole, "instances": [entries[0] | {"steps": 2}]},
        "nothing": {},
    }
    values = {"command": command, "code": 2, "err": "mmp: a sentence"}
    files = {name: json.dumps(whole).encode()}
    assert _judged(tmp_path / "whole", files, files, **values) == []
    for key, value in damaged.items():
        found = _judged(tmp_path / key, {name: json.dumps(value).encode()}, files, **values)
        assert [each.split(":")[0] for each in found] == [f"half-written {name}"], key
    lost = {name: json.dumps({**whole, "instances": entries[1:]}).encode()}
    (found,) = _judged(tmp_path / "lost", lost, files, there=files, **values)
    assert found.startswith('lost \'{"name": "a"')


def test_values_that_the_json_of_a_run_lacks_are_found(tmp_path):
    command = Command(["--json"])
    good = made_run(tmp_path, command=command, out='{"a": {"b": [1, 2]}}')
    run = made_run(tmp_path, command=command, out='{"a": {"b": [1]}}')
    assert judges.faults_of(run, "error", good) == ["exit code 0 without a.b.1 in the JSON"]


def test_the_second_run_may_leave_out_what_depends_on_the_first(tmp_path):
    command = Command([], depends="replaced")
    good = made_run(tmp_path, command=command, out="replaced it\nfolder x\n")
    run = made_run(tmp_path, command=command, out="folder x\n")
    assert judges.faults_of(run, "error", good) == ["exit code 0 without 'replaced it'"]
    assert judges.faults_after(run, good) == []
    assert judges.faults_after(replace(run, out=""), good) == ["then exit code 0 without 'folder x'"]


@pytest.mark.parametrize("kind", ["stderr", "closed"])
def test_lost_messages_do_not_change_the_exit_code(kind, tmp_path):
    good = made_run(tmp_path)
    run = replace(good, code=2, err="mmp: a sentence")
    assert judges.faults_of(run, kind, good) == ["exit code 2 instead of 0: mmp: a sentence"]


def _recording(path, rows):
    import rerun

    stream = rerun.RecordingStream("test")
    stream.save(path)
    for k in range(rows):
        stream.log("node", rerun.TextLog(str(k)))
    stream.disconnect()
    return path.read_bytes()


SHORT = "mmp: the recording a.rrd ends where the run failed\n"


@pytest.mark.parametrize(
    ("kind", "code", "rows", "err", "found"),
    [
        ("memory", 2, 2, SHORT, False),
        ("memory", 2, 4, SHORT, True),
        ("memory", 2, 2, "mmp: no", True),
        ("memory", 0, 2, SHORT, True),
        ("full", 2, 2, SHORT, True),
    ],
)
def test_a_recording_without_memory_may_be_shorter_if_a_sentence_says_so(kind, code, rows, err, found, tmp_path):
    command = Command([], timed=("a.rrd",))
    left, whole = _recording(tmp_path / "left.rrd", rows), _recording(tmp_path / "good.rrd", 3)
    faults = _judged(tmp_path, {"a.rrd": left}, {"a.rrd": whole}, kind, command=command, code=code, err=err)
    assert bool(faults) == found


def _film(path, frames):
    if path.suffix == ".gif":
        first, *others = map(Image.fromarray, frames)
        first.save(path, save_all=True, append_images=others)
    else:
        film = imageio_ffmpeg.write_frames(str(path), frames.shape[2:0:-1], pix_fmt_in="gray")
        film.send(None)
        for frame in frames:
            film.send(frame.tobytes())
        film.close()
    return path.read_bytes()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # imageio-ffmpeg closes no pipes
@pytest.mark.parametrize("suffix", ["gif", "mp4"])
@pytest.mark.parametrize(
    ("kind", "brighter", "count", "found"),
    [
        ("memory", 1, 3, None),
        ("memory", 30, 3, "frame 0 differs from that of the good run by "),
        ("memory", 1, 2, "another number of frames than the good run, from frame 2 on"),
        ("error", 1, 3, "bytes, not the"),
    ],
)
def test_films_drawn_without_memory_may_differ_in_shades_alone(kind, brighter, count, found, suffix, tmp_path):
    frames = np.linspace(60, 120, 3 * 32 * 32).astype(np.uint8).reshape(3, 32, 32)
    whole = _film(tmp_path / f"good.{suffix}", frames)
    left = _film(tmp_path / f"left.{suffix}", frames[:count] + np.uint8(brighter))
    faults = _judged(tmp_path, {f"a.{suffix}": left}, {f"a.{suffix}": whole}, kind)
    assert (not faults) if found is None else found in faults[0]
