"""`mmp run` refuses bad jobs and objects: one sentence, exit 2, and no file; a kill leaves no half file."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from mmp_cli.main import main
from mmp_planners.work.scheduler import Scheduler
from tests.support.object_jobs import DOWN, UP, above, box, carry, work

TAKE = {"name": "take", "arm": "arm0", "steps": [above(0.1, 0.2), DOWN, {"grasp": "red"}, UP]}
PUT_RED = carry("a", "red", (0.1, 0.2), (0.0, 0.3))
WIDE = {"name": "red", "shape": "box", "size": [0.3, 0.3, 0.3], "pose": {"position": [0.3, 0.2, 0.15]}}
TABLE = {"name": "table", "shape": "box", "position": [0, 0, -0.06], "size": [2, 2, 0.1]}
HAND = {
    "arms": [{"name": "arm0", "robot": "panda", "tool": "franka-hand", "position": [0, 0, 0]}],
    "obstacles": [TABLE],
}

BAD = {
    "unknown arm": (work(carry("a", "red", (0.1, 0.2), (0.0, 0.3), "arm7")), "unknown arm 'arm7'. Did you mean"),
    "unknown object": (work(carry("a", "rad", (0.1, 0.2), (0.0, 0.3))), "unknown object 'rad'. Did you mean 'red'?"),
    "unknown job": (work({**PUT_RED, "after": ["bb"]}), "after of job 'a': unknown job 'bb'"),
    "a cycle": (
        work({**PUT_RED, "after": ["b"]}, carry("b", "blue", (0.1, -0.2), (0.0, -0.3), after=["a"])),
        "these jobs wait for each other, so that none can begin: a after b after a",
    ),
    "held by another arm": (
        work(TAKE, {**TAKE, "name": "again", "arm": "arm1", "after": ["take"]}),
        "step 2 of job 'again' grasps 'red', which another arm holds since step 2 of job 'take'",
    ),
    "a full gripper": (
        work({"name": "a", "arm": "arm0", "steps": [above(0.1, 0.2), DOWN, {"grasp": "red"}, {"grasp": "blue"}]}),
        "step 3 of job 'a' grasps 'blue', but the gripper is full: it holds 'red'",
    ),
    "two jobs for one object": (
        work(PUT_RED, carry("b", "red", (0.1, 0.2), (0.0, -0.3), "arm1")),
        "jobs 'a' and 'b' both use object 'red', and neither comes after the other",
    ),
    "released but not held": (
        work({"name": "a", "arm": "arm0", "steps": [{"release": "red"}]}),
        "step 0 of job 'a' releases 'red', which is not held",
    ),
    "out of reach": (work(carry("a", "red", (0.1, 0.1), (0.0, 0.3))), "which is out of reach: it is 0.075 m from"),
    "a fall": (work(carry("a", "red", (0.1, 0.2), (0.0, 0.3, 0.05))), "so it would fall"),
    "a collision": (work(carry("a", "red", (0.1, 0.2), (0.14, -0.2))), "arm0/held and obstacle/blue"),
    "too wide": (
        work(carry("a", "red", (0.3, 0.2), (0.3, -0.2)), cell=HAND, objects=[WIDE]),
        "step 2 of job 'a' grasps 'red', which is 0.3 m wide; the gripper opens 0.08 m",
    ),
    "an object in another": (
        work(PUT_RED, objects=[box("red", 0.1, 0.2), box("blue", 0.12, 0.2)]),
        "objects 'red' and 'blue' overlap at the begin",
    ),
    "an object in an obstacle": (
        work(PUT_RED, objects=[box("red", 0.1, 0.2, -0.05)]),
        "object 'red' is in obstacle 'table' at the begin",
    ),
    "an object in an arm": (work(PUT_RED, objects=[box("red", 0.4, 0.0)]), "arm0/shoulder and obstacle/red"),
    "an object in the air": (work(PUT_RED, objects=[box("red", 0.1, 0.2, 0.1)]), "object 'red' does not stay where"),
    "no name": (
        work(PUT_RED, objects=[{"shape": "sphere", "radius": 0.1, "position": [0, 0, 0]}]),
        "objects[0].name is missing",
    ),
    "no object": (work({"name": "a", "arm": "arm0", "steps": [{"grasp": 3}]}), "grasp is 3; it must be the name"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_jobs_are_refused_with_one_sentence(name, tmp_path, capsys):
    data, words = BAD[name]
    (tmp_path / "jobs.json").write_text(json.dumps(data))
    assert main(["run", str(tmp_path / "jobs.json"), "--out", str(tmp_path / "schedule.json")]) == 2
    said = capsys.readouterr()
    (sentence,) = said.err.splitlines()
    assert sentence.startswith(f"mmp: {tmp_path / 'jobs.json'}: ")
    assert words in sentence
    assert said.out == ""
    assert os.listdir(tmp_path) == ["jobs.json"]


@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_a_kill_leaves_no_half_file(tmp_path, seconds):
    (tmp_path / "jobs.json").write_text(json.dumps(work(PUT_RED)))
    out = tmp_path / "schedule.json"
    out.write_text("older")
    code = "from mmp_cli.main import main; raise SystemExit(main())"
    process = subprocess.Popen([sys.executable, "-c", code, "run", "jobs.json", "--out", "schedule.json"], cwd=tmp_path)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert out.read_text() == "older" or json.loads(out.read_text())["schema"] == "mmp-schedule/1"


HALF_WRITTEN = """
import os, pathlib, signal
def write_half(path, text, **_):
    with open(path, "w") as file:
        file.write(text[: len(text) // 2])
    os.kill(os.getpid(), signal.SIGKILL)
pathlib.Path.write_text = write_half
from mmp_cli.main import main
main()
"""


def test_a_kill_during_the_write_leaves_the_older_file(tmp_path):
    (tmp_path / "jobs.json").write_text(json.dumps(work(PUT_RED)))
    out = tmp_path / "schedule.json"
    out.write_text("older")
    command = [sys.executable, "-c", HALF_WRITTEN, "run", "jobs.json", "--out", "schedule.json"]
    assert subprocess.run(command, cwd=tmp_path, check=False).returncode == -signal.SIGKILL
    assert out.read_text() == "older"


def test_ctrl_c_during_planning_ends_the_program_without_a_file(tmp_path, capsys, monkeypatch):
    (tmp_path / "jobs.json").write_text(json.dumps(work(PUT_RED)))
    steps = []

    def interrupted(*_):
        steps.append("step")
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Scheduler, "_go_on", interrupted)
    assert main(["run", str(tmp_path / "jobs.json"), "--out", str(tmp_path / "schedule.json")]) == 130
    assert capsys.readouterr().err == "mmp: interrupted; no schedule file was written\n"
    assert steps == ["step"]
    assert os.listdir(tmp_path) == ["jobs.json"]
