"""Files of the wrong kind, pipes and terminals: messages name them, and a pipe of the shell is read."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from support import bad_files
from support.refusals import assert_refused

from mmp_env.files.reading import MAX_JSON_BYTES, MAX_YAML_BYTES

MMP = [sys.executable, "-c", "from mmp_cli.main import main; raise SystemExit(main())"]
RESULT = json.dumps({"instance": "pair/turn", "planner": "ecbs", "status": "solved", "planning_time_s": 0.1})
TRAJECTORY = "header: {frame_id: ''}\njoint_names: [arm0/joint1]\npoints: []\n"
FILES = {
    "an instance file": ("pairs.json", json.dumps(bad_files.good_instances())),
    "a cell file": ("pair.json", json.dumps(bad_files.good_cell())),
    "a plan": ("plan.json", json.dumps(bad_files.good_plan())),
    "an episode": ("episode.json", json.dumps({"schema": "mmp-episode/1", "plans": [bad_files.good_plan()]})),
    "a file of jobs": ("jobs.json", json.dumps({"schema": "mmp-jobs/1", "jobs": []})),
    "a schedule": ("schedule.json", json.dumps({"schema": "mmp-schedule/1", "trajectories": {}})),
    "a file of results": ("results.jsonl", f"{RESULT}\n{RESULT}\n"),
    "a ROS 2 trajectory": ("plan.yaml", TRAJECTORY),
}
TAKEN = {
    "plan": ("an instance file", "a cell file"),
    "bench": ("an instance file", "a cell file"),
    "check": ("a plan", "an episode", "a schedule"),
    "export": ("a plan", "an episode"),
    "show": ("a plan", "an episode"),
}
WORDS = {
    "plan": "SOURCE is an environment id, an instance file or a cell file",
    "bench": "SOURCE is an environment id, an instance file or a cell file",
    "check": "`mmp check` takes plans, episodes and schedules",
    "export": "`mmp export` takes plans and episodes",
    "show": "`mmp show` takes plans, episodes, recordings, benchmark folders, pages and pictures",
}


@pytest.mark.parametrize(
    ("command", "kind"), [(command, kind) for command in TAKEN for kind in FILES if kind not in TAKEN[command]]
)
def test_a_file_of_another_kind_is_called_by_its_name(mmp, tmp_path, command, kind):
    name, text = FILES[kind]
    path = tmp_path / name
    path.write_text(text)
    more = ["--to", tmp_path / "out.csv"] if command == "export" else []
    assert_refused(mmp(command, path, *more), f"mmp: {path} is {kind}; {WORDS[command]}\n")


def test_a_trajectory_that_is_too_long_for_a_cell_file_is_named_as_trajectory(mmp, tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(TRAJECTORY + "# more points\n" * (MAX_YAML_BYTES // 10))
    assert_refused(mmp("check", path), f"mmp: {path} is a ROS 2 trajectory; {WORDS['check']}\n")
    path.write_text("# a cell\n" * (MAX_YAML_BYTES // 8))
    assert_refused(mmp("plan", path), f"{path} is larger than 0.25 MB")


def test_a_single_line_of_results_is_recognised(mmp, tmp_path):
    (tmp_path / "results.jsonl").write_text(RESULT)
    assert_refused(mmp("check", tmp_path / "results.jsonl"), "is a file of results")


def test_a_missing_file_is_not_called_results(mmp, tmp_path):
    assert_refused(mmp("check", tmp_path / "results.jsonl"), "results.jsonl cannot be read: No such file")


def test_unreadable_results_are_named(mmp, tmp_path):
    path = tmp_path / "results.jsonl"
    path.write_bytes(b"\xff")
    assert_refused(mmp("check", path), "results.jsonl is not text in UTF-8")
    os.truncate(path, MAX_JSON_BYTES + 1)
    assert_refused(mmp("check", path), "results.jsonl is larger than 64 MB")


def refuse_a_named_pipe(folder, *words):
    os.mkfifo(folder / "pipe")
    more = [str(folder)] if "report" in words else []
    run = subprocess.run(
        [*MMP, *words, str(folder / "pipe"), *more], capture_output=True, text=True, check=False, timeout=60
    )
    assert run.returncode == 2
    assert run.stderr == f"mmp: {folder / 'pipe'} cannot be read: it is not a regular file\n"


@pytest.mark.parametrize("words", [["check"], ["show"], ["plan"], ["report", "--against"]])
def test_a_named_pipe_is_not_waited_for(tmp_path, words):
    refuse_a_named_pipe(tmp_path, *words)


def test_a_named_pipe_among_the_devices_is_not_waited_for():
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        refuse_a_named_pipe(Path(folder), "check")


def test_a_terminal_is_not_waited_for():
    ours, theirs = os.openpty()
    try:
        run = subprocess.run(
            [*MMP, "check", "/dev/stdin"], stdin=theirs, capture_output=True, text=True, check=False, timeout=60
        )
    finally:
        os.close(ours)
        os.close(theirs)
    assert run.returncode == 2
    assert run.stderr == "mmp: /dev/stdin cannot be read: it is not a regular file\n"


@pytest.mark.parametrize("line", ['cat "$3" | "$1" -c "$2" check /dev/stdin', '"$1" -c "$2" check <(cat "$3")'])
def test_a_pipe_of_the_shell_is_read(plan, line):
    words = ["bash", "-c", line, "bash", MMP[0], MMP[2], str(plan)]
    run = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert run.returncode == 0, run.stderr
    assert ": valid; clearance" in run.stdout
