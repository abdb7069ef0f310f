"""The fuzzer: it finds planted faults, and no input that once failed fails again."""

import importlib
import io
import json
import math
import random
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from fuzz import (
    arguments,
    changes,
    inputs,
    judges,
    mesh_samples,
    option_validator,
    planted_faults,
    samples,
    validator,
)
from fuzz.process import Worker
from support import checkout_scripts

from mmp_cli.main import COMMANDS, main

REGRESSIONS = sorted((Path(__file__).parent / "fuzz" / "regressions").glob("*.json"))
FOUND = {
    "raises": "traceback",
    "planner_raises": "planner 'x' raised ValueError",
    "waits": "no answer within 6 s",
    "works": "no answer within 1 s of processor time",
    "works_in_a_child": "no answer within 1 s of processor time",
    "crashes": "signal 11: an assertion failed",
    "leaves_half_a_file": "refused, and left out.json",
    "is_silent": "exit code 2 without a sentence",
    "accepts_everything": "two arms of one name",
    "overwrites": "changed cell.json",
    "fails_in_silence": "exit code 1 without a sentence",
    "refuses_in_many_lines": "a message of 30 lines",
    "warns": "a warning of Python",
    "writes_past_python": "a library wrote: a library is not content",
}


@pytest.fixture(scope="module")
def worker():
    out = Worker()
    yield out
    out.close()


def given(kind, limits_s=samples.TIME_LIMITS_S, **files):
    return inputs.Input(kind=kind, line=inputs.with_limits(samples.LINES[kind][1], limits_s), files=files)


@pytest.mark.parametrize("kind", samples.LINES)
def test_the_good_inputs_are_accepted(kind, worker):
    limits_s = samples.TIME_LIMITS_S | {"plan": 3.0}  # enough for a core with sanitizers
    code, faults = inputs.tried(given(kind, limits_s), worker)
    assert (code, faults) == (2 if kind in samples.NOT_DRAWN else 0, [])


@pytest.mark.parametrize("path", REGRESSIONS, ids=lambda path: path.stem)
def test_what_once_failed_is_handled(path, worker):
    text = path.read_text()
    if "arguments" in json.loads(text):
        assert worker.ask({"call": text})["fault"] == ""
        return
    code, faults = inputs.tried(inputs.Input.from_json(text), worker)
    assert code is not None, faults
    assert faults == []


def test_every_planted_fault_has_a_test():
    assert set(FOUND) == {
        name
        for name, value in vars(planted_faults).items()
        if getattr(value, "__module__", "") == planted_faults.__name__
    }


@pytest.mark.parametrize("planted", FOUND)
def test_planted_faults_are_found(planted):
    worker = Worker(longest_s=1.0)
    double = b'{"arms": [{"name": "a"}, {"name": "a"}]}'
    _, faults = inputs.tried(given("cell", **{"cell.json": double}), worker, planted)
    assert any(FOUND[planted] in fault for fault in faults), faults
    worker.close()


NONSENSE = {
    "no length.json": '{"shape": "box", "size": [0, 1, 1]}',
    "a truth value for a length.json": '{"shape": "box", "size": [true, 1, 1]}',
    "a word for a length.json": '{"shape": "box", "size": "x"}',
    "nan.json": "[NaN]",
    "too large.json": '{"a": 1e999}',
    "digits.json": f"[1{'0' * 400}]",
    "a scalar.json": "3",
    "a margin below zero.json": '{"margin": {"arms": -1}}',
    "a velocity below zero.json": '{"max_velocity": -3}',
    "times that go back.json": '{"times": [0, 1, 0.5]}',
    "no turn.json": '{"quaternion": [0, 0, 0, 0]}',
    "two arms.yaml": "arms: [{name: a}, {name: a}]",
    "half.yaml": "arms: [{name: a}",
    "nan.jsonl": '{"a": 1}\n{"a": NaN}\n',
    "two links.urdf": '<robot><link name="a"/><link name="a"/></robot>',
    "limits.urdf": '<robot><joint name="j"><limit lower="1" upper="-1"/></joint></robot>',
    "nan.xml": '<mujoco><body pos="0 nan 0"/></mujoco>',
    "half.urdf": "<robot>",
    "nan.obj": "v 0 nan 0",
    "a vertex beyond.obj": "v 0 0 0\nf 1 2 1",
    "nan.off": "OFF\n1 1 0\n0 nan 0\n3 0 0 0",
    "a vertex beyond.off": "OFF\n1 1 0\n0 0 0\n3 0 1 0",
    "nan.ply": mesh_samples.ply_header("ascii", 1, 1) + "0 nan 0\n3 0 0 0",
    "a vertex beyond.ply": mesh_samples.ply_header("ascii", 1, 1) + "0 0 0\n3 0 -1 0",
    "a field of a cell.json": '{"arms": [], "obstaclesx": []}',
    "a field of an arm.yaml": "arms: [{name: a, positionx: [0, 0, 0]}]",
    "a field of a held object.json": '{"arms": [{"name": "a", "held": {"sizex": [1, 1, 1]}}]}',
    "a field of a carried robot.json": '{"arms": [], "robots": {"r": {"robot.json": {"homex": []}}}}',
    "a field of an instance.json": '{"schema": "mmp-instances/1", "instances": [{"keepx": {}}]}',
    "an unknown arm.json": '{"schema": "mmp-jobs/1", "cell": {"arms": [{"name": "a"}]}, "start": {"b": [0]}}',
    "a field of margins.json": '{"schema": "mmp-plan/1", "problem": {"margins": {"armsx": 1}}}',
    "a field of a plan in an episode.json": '{"schema": "mmp-episode/1", "plans": [{"timesx": []}]}',
    "a field of a step.json": '{"schema": "mmp-jobs/1", "jobs": [{"steps": [{"movex": "home"}]}]}',
    "a field of an event.json": '{"schema": "mmp-schedule/1", "events": [{"untilx": 1}]}',
    "a field of a benchmark.json": '{"schema": "mmp-bench/1", "countx": 1}',
    "a field of a dataset.json": '{"schema": "mmp-dataset/1", "settings": {"seedx": 1}}',
    "robot/robot.json": '{"joints": [{"lowerx": 1}]}',
    "robot/tool.json": '{"openingx": 1}',
    "robot/spheres.json": '{"29": {}}',
    "robot/hulls.json": '{"link": [{"radiusx": 1}]}',
    "goal.json": '{"left": {"posex": {}}}',
    "results.jsonl": '{"cost_radx": 1}\n',
}


@pytest.mark.parametrize("name", NONSENSE)
def test_the_validator_knows_nonsense(name):
    assert set(validator.file_nonsense(name, NONSENSE[name].encode())) - {validator.NO_KIND}


def test_the_validator_takes_the_good_files_and_free_fields():
    free = json.loads(samples.contents()["plan.json"]) | {"planner": {"x": 1}, "stats": {"y": {"z": 1}}}
    for name, content in (samples.contents() | {"free.json": json.dumps(free).encode()}).items():
        assert validator.file_nonsense(name, content) == [], name


WRONG_EPISODES = {
    "text": ("actions", lambda rows: rows.astype(str)),
    "three joints": ("actions", lambda rows: rows[:, :3]),
    "nan": ("actions", lambda rows: rows * np.nan),
    "beyond 1": ("actions", lambda rows: rows + 2),
    "two rewards": ("rewards", lambda rows: rows[:2]),
    "infinite": ("rewards", lambda rows: rows + np.inf),
    "objects": ("rewards", lambda rows: rows.astype(object)),
    "no first observation": ("observations.clearance", lambda rows: rows[1:]),
    "contacts": ("infos.contacts", lambda rows: rows - 1),
    "cut off": ("truncations", lambda rows: ~rows),
}


@pytest.mark.parametrize(("array", "change"), WRONG_EPISODES.values(), ids=WRONG_EPISODES)
def test_the_validator_knows_wrong_episodes(array, change):
    name, out = samples.LINES["continued episodes"][0], io.BytesIO()
    with np.load(io.BytesIO(samples.contents()[name])) as file:
        np.savez(out, **dict(file) | {array: change(file[array])})
    assert validator.file_nonsense(name, out.getvalue())
    assert validator.file_nonsense(name, samples.contents()[name][:-100])


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("bytes.ply", struct.pack("<3i", 1, 5, 7), struct.pack("<3i", 1, 2**30, 7)),
        ("bytes.ply", struct.pack("<f", 0.05), struct.pack("<f", math.nan)),
        ("box.glb", struct.pack("<3I", 1, 5, 7), struct.pack("<3I", 1, 5, 8)),
        ("box.glb", struct.pack("<f", 0.05), struct.pack("<f", math.inf)),
        ("box.dae", b"<p>0 1", b"<p>0 9"),
        ("box.dae", b"0.05", b"NaN"),
    ],
)
def test_the_validator_knows_nonsense_in_binary_meshes_and_collada(name, old, new):
    content = samples.contents()[name]
    assert old in content
    assert validator.file_nonsense(name, content.replace(old, new, 1))


BAD_OPTIONS = (
    *("--margin -1", "--margin arms=0", "--seed 0.5", "--count 0", "--time-limit nan", "--rate x", "--tolerance 0"),
    *("--set w=-1", "--set w=0.9", "--set w=nan", "--set tight.w=0", "--set shortcuts=-1", "--set shortcuts=0.3"),
    *("--set dt=0", "--set dt=inf", "--set waits=x", "--set trace=7", "--set step=-1", "--set unknown=1"),
    *("--start nan", "--start left=nan", "--start left=[NaN]", "--start stay", "--start 1", "--goal left=hom"),
    *('--goal left={"posex":1}', '--goal {"left":{"anyx":[]}}', '--keep left={"uprightx":1}', "--keep left=1"),
    *('--keep left={"upright":{"axis":[0,0,1],"within":-1}}', '--keep left={"upright":{"axis":[0,0,0],"within":1}}'),
    *('--keep left={"upright":{"within":1}}', '--goal left={"pose":{"position":[0,1],"free":"rotation"}}'),
    *('--start left={"pose":{"position":[0,0,1]}}', '--goal {"left":{"any":[]}}', '--goal left=["x"]'),
    *("--format x", "--control-mode x", "--planner x", "--robot x", "--task x", "--memory-limit 0"),
)


@pytest.mark.parametrize("line", BAD_OPTIONS)
def test_the_validator_knows_options(line):
    assert option_validator.option_nonsense(["plan", *line.split()])


@pytest.mark.parametrize(
    "line",
    [
        "--margin arms=0.01,self=1e-3 --seed 0 --count 1 --time-limit inf --planner ecbs --robot panda --format npz",
        "--set w=1 --set tight.step=0.1 --set step=gradient --set trace=on --set shorten=0 --set dt=1e-3",
        "--start left=[0,1] --start home --goal stay --goal @x",
        '--goal left={"any":["home",{"pose":{"position":[0,0,1],"free":"rotation"}}]}',
        '--keep left={"upright":{"axis":[0,0,1],"within":1}} --keep @x',
        '--keep {"left":{"upright":{"axis":[1,0,0],"within":1}}}',
    ],
)
def test_the_validator_takes_good_options(line):
    assert option_validator.option_nonsense(["plan", *line.split()]) == []


@pytest.mark.parametrize(
    ("name", "content"),
    {
        "a.npz": b"PK",
        "a.svg": b"<svg>",
        "a.xml": b"<a>",
        "a.png": b"\x89PNG",
        "a.rrd": b"RRF2",
        "a.html": b"<html>",
        "a.hdf5": b"\x89HDF",
        "a.gif": b"GIF89a",
        "a.mp4": b"moov",
        "a.unknown": b"x",
        "a": b"{",
        "empty.npz": b"",
    }.items(),
)
def test_a_written_file_that_is_broken_is_a_fault(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    run = judges.Run(line=["plan", "x"], code=0, out="", err="", folder=tmp_path, before={})
    assert any(f"wrote {name} that cannot be used" in fault for fault in judges.faults(run))


def test_the_same_seed_gives_the_same_inputs_and_most_differ():
    good = samples.contents()
    drawn = [inputs.drawn(good, random.Random(f"{k}")) for k in range(200)]
    assert drawn == [inputs.drawn(good, random.Random(f"{k}")) for k in range(200)]
    assert len({each.to_json() for each in drawn}) > 150
    many = (inputs.drawn(good, random.Random(f"{k}")) for k in range(2000))
    assert {each.kind for each in many} == set(samples.LINES)


def help_of(command, capsys):
    with pytest.raises(SystemExit):
        main([*command, "--help"])
    return capsys.readouterr().out


def test_the_options_of_all_commands_are_tried(capsys):
    tried = {changes.command_of(line) for _, line in samples.LINES.values()}
    actions = {name: re.search(r"{(.*?)}", help_of([name], capsys))[1].split(",") for name in ("robot", "tool")}
    commands = [(name,) for name in COMMANDS if name not in actions]
    assert tried == {*commands, *((name, action) for name in actions for action in actions[name])}
    own = set(arguments.OWN_ARGUMENTS)
    for command in sorted(tried):
        own -= set(changes.options(command))
        printed = set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", help_of(command, capsys), re.MULTILINE))
        drawn = {changes.changed_line(list(command), random.Random(k))[len(command)] for k in range(500)}
        assert drawn == printed - set(changes.LEFT_OUT), command
    assert not own


@pytest.fixture
def fuzzer(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("fuzz.__main__")


def test_a_run_has_another_seed_each_time_and_prints_it_first(fuzzer, monkeypatch, capsys):
    printed = []
    for clock in (7.0, 8.0):
        monkeypatch.setattr(fuzzer.time, "time", lambda clock=clock: clock)
        monkeypatch.setattr("sys.argv", ["fuzz", "--minutes", "0", "--workers", "1"])
        assert fuzzer.main() == 0
        lines = capsys.readouterr().out.splitlines()
        printed += [lines[0].split()[1], json.loads(lines[-1])["seed"]]
    assert printed == ["7", 7, "8", 8]


def test_only_exit_code_0_counts_as_accepted(fuzzer, capsys, monkeypatch):
    codes = iter([0, 0, 1, 2, 2, 2, None])
    monkeypatch.setattr(fuzzer.inputs, "tried", lambda given, worker: (next(codes), []))
    tested = fuzzer.Fuzzing(fuzzer.Settings(0, 0.0, Path(), 1.0, 0.0), {})
    for _ in range(7):
        tested._try(None, given("cell"), "")
    fuzzer.print_summary(tested, "x", 0)
    figure = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert [figure[key] for key in ("value", "accepted", "exit_1", "exit_2")] == [7, 2, 1, 3]
    assert figure["core_returned"] == 0


def test_kept_inputs_go_where_the_first_lines_say(fuzzer, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("sys.argv", ["fuzz", "--minutes", "0", "--workers", "1", "--keep", str(tmp_path / "kept")])
    assert fuzzer.main() == 0
    assert f"inputs that fail are kept in {tmp_path / 'kept'}" in capsys.readouterr().out
    assert (tmp_path / "kept").is_dir()
