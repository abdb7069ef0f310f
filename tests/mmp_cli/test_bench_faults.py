"""A faulty planner costs one line of status `error` that says what the planner did. The other units run."""

import contextlib
import errno
import json
import multiprocessing
import os
import subprocess
import tempfile

import pytest
from support import bench_runs

from mmp_cli.benchmark import worker_slot
from mmp_cli.benchmark.job import Examination, Job, Verdict
from mmp_cli.benchmark.worker import READY
from mmp_cli.benchmark.worker_slot import WorkerSlot
from mmp_cli.pipe_reader import PipeReader

CRASH = "killed by SIGSEGV"
DEEDS = {
    "raise": ["plan() raised KeyError: 'a bug'"],
    "crash": [CRASH, "while planning", "in _crash (bench_stand_ins.py, line "],
    "hang": ["still planning 2 s after its time limit of 0.5 s"],
    "tear": ["still planning 2 s after its time limit of 0.5 s"],
    "stop": ["raised StopPlanning: enough"],
    "exit": ["raised SystemExit: 0"],
    "leave": ["ended with exit code 3"],
    "interrupt": ["raised KeyboardInterrupt"],
    "nothing": ["None", "PlanResult"],
    "plan": ["Plan", "PlanResult"],
    "status": ["'won'", "solved, timeout"],
    "no_plan": ["solved without a plan"],
    "a_plan_and_a_timeout": ["timeout with a plan"],
    "another_plan": ["list"],
    "arms": ["no positions of arm 'left'"],
    "stats": ["expanded_nodes is 'many'"],
    "no_stats": ["int", "mapping"],
    "objects": ["bound_met", "object"],
    "unusual": ["plan() raised Unusual: so there"],
    "mute": ["plan() raised Mute, whose text cannot be read"],
    "guarded": ["what plan() returned cannot be read: Unusual: hands off"],
    "no_options": ["the planner of the plan has the options null; they must be a mapping"],
    "text": ["where numbers are wanted"],
    "no_number": ["the plan holds nan where finite numbers are wanted"],
    "all_text": ["the plan's numbers are of type str"],
    "meddle": ["THE CHECKER REFUTES THE PLAN: start"],
    "other_problem": ["THE CHECKER REFUTES THE PLAN: start"],
}
PLANNERS = {
    "sulks": ["RuntimeError: not today"],
    "odd": ["seed"],
    "absent": ["No module named 'no_such_package'"],
    "deadly": [CRASH, "while preparing", "deadly_import.py, line 2"],
    "leaving": ["SystemExit: bye"],
}
GOOD = "quick"


def test_every_fault_of_a_planner_is_an_error_that_names_it_and_harms_no_other(tmp_path):
    labels = {deed.replace("_", "-"): words for deed, words in DEEDS.items()}
    planners = ",".join([*(f"{label}=rogue" for label in labels), *PLANNERS, GOOD])
    deeds = [word for deed in DEEDS for word in ("--set", f"{deed.replace('_', '-')}.deed={deed}")]
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    ran = bench_runs.bench(tmp_path, source, "--planners", planners, *deeds, "--time-limit", 0.5, "--out", out)
    assert ran.code == 0
    lines = {line["planner"]: line for line in bench_runs.lines(out)}
    assert lines.pop(GOOD)["status"] == "solved"
    assert {line["status"] for line in lines.values()} == {"error"}
    expected = labels | PLANNERS
    assert lines.keys() == expected.keys()
    messages = {planner: line["message"] for planner, line in lines.items()}
    assert {p: messages[p] for p in messages if not all(words in messages[p] for words in expected[p])} == {}
    for planner in PLANNERS:
        assert f"mmp bench: planner {planner}" in ran.err.replace("'", "")


def test_a_planner_that_eats_the_memory_is_killed_and_the_next_one_runs(tmp_path):
    planners = ["--planners", "rogue,quick", "--set", "rogue.deed=eat", "--memory-limit", 350, "--workers", 1]
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    assert bench_runs.bench(tmp_path, source, *planners, "--out", out).code == 0
    eater, quick = bench_runs.lines(out)
    assert (eater["status"], quick["status"]) == ("error", "solved")
    assert "MB while planning, over the memory limit of 350 MB" in eater["message"]


def test_a_plan_that_comes_long_after_the_time_limit_does_not_count(tmp_path):
    words = ["--planners", "slow", "--set", "takes=1.5", "--set", f"folder={tmp_path}", "--time-limit", 0.2]
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    assert bench_runs.bench(tmp_path, source, *words, "--out", out).code == 0
    (line,) = bench_runs.lines(out)
    assert (line["status"], line["cost_rad"]) == ("timeout", None)
    assert "after the time limit" in line["message"]


def test_an_instance_that_cannot_be_drawn_is_an_error_with_the_reason(tmp_path):
    cell = bench_runs.cell("full")
    cell["obstacles"] = [{"name": "wall", "shape": "box", "position": [0, 0, 0.6], "size": [2.5, 2.5, 0.9]}]
    (tmp_path / "full.json").write_text(json.dumps(cell))
    words = ["--planners", "quick", "--count", 1, "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, tmp_path / "full.json", *words).code == 0
    (line,) = bench_runs.lines(tmp_path / "out")
    assert line["status"] == "error"
    assert "no problem could be made" in line["message"]


def test_a_planner_that_changes_the_instance_leaves_it_to_the_next_as_it_was(tmp_path):
    source = bench_runs.many_instances(tmp_path, 2)
    plans = []
    for planners in ("rogue,quick", "quick"):
        words = ["--planners", planners, "--workers", 1, "--save-plans", "--out", tmp_path / planners]
        sets = ["--set", "rogue.deed=meddle"] if "rogue" in planners else []
        assert bench_runs.bench(tmp_path, source, *words, *sets).code == 0
        lines = [line for line in bench_runs.lines(tmp_path / planners) if line["planner"] == "quick"]
        assert [line["status"] for line in lines] == ["solved", "solved"]
        plans.append([(tmp_path / planners / line["plan"]).read_bytes() for line in lines])
    assert plans[0] == plans[1]


@pytest.mark.parametrize("deed", ["fork", "fork_and_stay"])
def test_a_planner_that_forks_has_one_line_for_each_of_its_units(tmp_path, deed):
    source, out = bench_runs.many_instances(tmp_path, 6), tmp_path / "out"
    words = ["--planners", "rogue,quick", "--set", f"rogue.deed={deed}", "--workers", 2, "--out", out]
    assert bench_runs.bench(tmp_path, source, *words).code == 0
    lines = bench_runs.lines(out)
    assert len(lines) == len({(line["instance"], line["planner"]) for line in lines}) == 12
    assert {line["status"] for line in lines} == {"solved"}


@pytest.mark.parametrize(("deed", "field"), [("endless", "makespan_s"), ("countless", "expanded_nodes")])
def test_an_unreadable_number_costs_its_unit_alone(mmp, tmp_path, deed, field):
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    words = ["--planners", "rogue,quick", "--set", f"rogue.deed={deed}", "--workers", 1, "--out", out]
    bench_runs.bench(tmp_path, source, *words)
    lines = {line["planner"]: line for line in bench_runs.lines(out)}
    assert {name: line["status"] for name, line in lines.items()} == {"rogue": "error", "quick": "solved"}
    assert lines["rogue"]["message"].startswith(f"the result: {field} is ")
    assert mmp("report", out).code == 0


def test_a_planner_that_changes_its_folder_does_not_change_that_of_the_next(tmp_path):
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    words = ["--planners", "rogue,slow", "--set", "rogue.deed=move", "--workers", 1, "--out", out]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        assert bench_runs.bench(tmp_path, source, *words).code == 0
    assert {line["status"] for line in bench_runs.lines(out)} == {"solved"}
    assert len(list(tmp_path.glob("pair-turn0.*"))) == 1  # `slow` left its mark in its own folder "."


def dying_starts(monkeypatch, folder, dead):
    """Kills the worker at the starts whose numbers, from 0, are in `dead`."""
    count = folder / "starts"
    count.write_text("")
    program = (
        (
            f"import os, pathlib, signal; count = pathlib.Path({str(count)!r}); start = len(count.read_text());"
            f" count.write_text('x' * (start + 1)); start in {dead!r} and os.kill(os.getpid(), signal.SIGKILL); "
        )
        .replace("{", "{{")
        .replace("}", "}}")
    )
    monkeypatch.setattr(worker_slot, "_PROGRAM", program + worker_slot._PROGRAM)


def test_a_worker_that_is_killed_while_it_starts_is_started_once_more(tmp_path, monkeypatch):
    dying_starts(monkeypatch, tmp_path, [0])
    source, out = bench_runs.many_instances(tmp_path, 2), tmp_path / "out"
    assert bench_runs.bench(tmp_path, source, "--planners", "quick", "--workers", 1, "--out", out).code == 0
    assert [line["status"] for line in bench_runs.lines(out)] == ["solved", "solved"]


def test_a_worker_that_is_killed_at_both_starts_costs_its_unit_alone(tmp_path, monkeypatch):
    dying_starts(monkeypatch, tmp_path, [1, 2])
    source, out = bench_runs.many_instances(tmp_path, 2), tmp_path / "out"
    words = ["--planners", "rogue,quick", "--set", "rogue.deed=leave", "--workers", 1, "--out", out]
    assert bench_runs.bench(tmp_path, source, *words).code == 0
    messages = {(line["instance"], line["planner"]): line["message"] for line in bench_runs.lines(out)}
    assert len(messages) == 4
    assert "a worker process does not start: " in messages["pair/turn0", "quick"]
    assert "was killed by SIGKILL" in messages["pair/turn0", "quick"]
    assert messages["pair/turn1", "quick"] is None


def test_without_any_worker_nothing_is_written(tmp_path, monkeypatch):
    dying_starts(monkeypatch, tmp_path, range(100))
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    code = bench_runs.bench(tmp_path, source, "--planners", "quick", "--workers", 1, "--out", out)
    assert (code.code, code.out, code.err.count("\n")) == (2, "", 1)
    assert code.err.startswith("mmp: a worker process does not start: ")
    assert not out.exists()


def test_a_log_of_a_worker_that_cannot_be_emptied_costs_no_unit(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "ftruncate", fail)
    source, out = bench_runs.many_instances(tmp_path, 2), tmp_path / "out"
    assert bench_runs.bench(tmp_path, source, "--planners", "quick", "--workers", 1, "--out", out).code == 0
    assert [line["status"] for line in bench_runs.lines(out)] == ["solved", "solved"]


def test_without_room_for_a_log_nothing_is_run(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", fail)
    source, out = bench_runs.many_instances(tmp_path, 1), tmp_path / "out"
    code = bench_runs.bench(tmp_path, source, "--planners", "quick", "--workers", 1, "--out", out)
    assert (code.code, code.out, out.exists()) == (2, "", False)
    assert code.err.startswith("mmp: a temporary file cannot be made: No space left on device; ")


def test_a_late_answer_to_an_earlier_task_is_ignored(monkeypatch):
    ours, theirs = multiprocessing.Pipe()

    def start(self):
        self._process, self._connection = subprocess.Popen(["sleep", "60"], process_group=0), ours
        self._messages = PipeReader(ours.fileno())
        theirs.send((0, READY))

    monkeypatch.setattr(WorkerSlot, "_start", start)
    job = Job(sources=(), variants={}, time_limit_s=60.0, memory_limit_mb=4096)
    with theirs, contextlib.closing(WorkerSlot(job)) as one:
        for name in ("first", "second"):
            one.give(Examination(planner=name))
            number, task = theirs.recv()
            assert task.planner == name
            theirs.send((number, Verdict(fault=name)))
            assert one.look() == Verdict(fault=name)
            theirs.send((number, Verdict(fault=f"{name} again")))
