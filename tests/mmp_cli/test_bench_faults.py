"""Whatever a planner does, it costs one line of status error that says what it did, and the rest goes on."""

import json

import bench_runs

CRASH = "killed by SIGSEGV"
DEEDS = {
    "raise": ["plan() raised KeyError: 'a bug'"],
    "crash": [CRASH, "while planning", "in _crash (bench_stand_ins.py, line "],
    "hang": ["still planning 2 s after its time limit of 0.5 s"],
    "stop": ["raised StopPlanning: enough"],
    "exit": ["raised SystemExit: 0"],
    "leave": ["ended by itself with exit code 3"],
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


def test_whatever_a_planner_does_is_an_error_that_says_how_and_harms_no_other(tmp_path):
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
    told = {planner: line["message"] for planner, line in lines.items()}
    assert {p: told[p] for p in told if not all(words in told[p] for words in expected[p])} == {}
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
