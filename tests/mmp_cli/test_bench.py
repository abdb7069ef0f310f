import json
import types

import numpy as np
import pytest
import yaml
from support import bad_files, bench_runs

from mmp_env import check_plan
from mmp_env.files.plan_file import load_plan
from mmp_env.files.reading import read_document
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell

COUNTS = ["expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits"]
LINE = [
    *("instance", "planner", "seed", "status", "planning_time_s", "check_time_s", *COUNTS),
    *("cost_rad", "makespan_s", "root_conflicts", "cost_lower_bound_rad", "min_clearance_m"),
    *("margins_asked", "margins_proved"),
    *("bound_met", "deadline_hit", "plan", "version", "machine", "cell", "arms", "message", "workers", "load"),
]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Returns a benchmark of two instances, one of them invalid, with three planners. One returns a wrong plan."""
    path = tmp_path_factory.mktemp("finished")
    instances, out = bench_runs.instances(path), path / "out"
    planners = "quick,cautious=quick,helpless,liar"
    sets = ["--set", "quick.w=2", "--set", "cautious.steps=9", "--seed", 7]
    ran = bench_runs.bench(path, instances, "--planners", planners, *sets, "--out", out, "--save-plans")
    lines = {(line["instance"], line["planner"]): line for line in bench_runs.lines(out)}
    return types.SimpleNamespace(ran=ran, out=out, lines=lines)


def test_each_instance_and_planner_has_one_line_with_the_fields_of_the_contract(finished):
    assert finished.ran.code == 0
    assert len(bench_runs.lines(finished.out)) == len(finished.lines) == 8
    for line in finished.lines.values():
        assert list(line) == LINE
        assert (line["seed"], line["cell"], line["arms"]) == (7, "pair", 2)
        assert line["version"]
        assert "cores" in line["machine"]
        assert line["workers"] == 2
        assert line["load"] >= 0


def test_a_solved_instance_has_all_its_numbers(finished):
    line = finished.lines["pair/turn", "quick"]
    assert (line["status"], line["message"], line["bound_met"]) == ("solved", None, True)
    assert line["cost_rad"] == pytest.approx(line["cost_lower_bound_rad"]) == pytest.approx(1.0)
    assert line["makespan_s"] == pytest.approx(0.5 / 0.8 * 1.01)
    assert line["min_clearance_m"] > 0
    assert line["planning_time_s"] >= 0
    assert line["check_time_s"] > 0


def test_an_invalid_instance_is_a_line_for_each_planner_and_is_not_planned(finished):
    for planner in ("quick", "cautious", "helpless", "liar"):
        line = finished.lines["pair/outside", planner]
        assert (line["status"], line["planning_time_s"], line["plan"]) == ("invalid", None, None)
        assert "joint 3" in line["message"]
        assert "pairs.json" not in line["message"], "where the file lies is no part of a result"
    assert f"invalid: {line['message']} (pair/outside)" in finished.ran.err


def test_no_plan_in_time_is_a_timeout_with_its_counts(finished):
    line = finished.lines["pair/turn", "helpless"]
    assert (line["status"], line["expanded_nodes"], line["deadline_hit"]) == ("timeout", 17, True)
    assert line["cost_rad"] is line["check_time_s"] is line["min_clearance_m"] is line["plan"] is None


def test_a_refuted_plan_is_an_error_with_a_loud_message(finished):
    line = finished.lines["pair/turn", "liar"]
    assert (line["status"], line["cost_rad"], line["min_clearance_m"]) == ("error", None, None)
    assert "THE CHECKER REFUTES THE PLAN: goal" in line["message"]
    assert "liar: THE CHECKER REFUTES THE PLAN" in finished.ran.err
    assert not check_plan(read_document(finished.out / line["plan"])).valid


def test_saved_plans_are_at_the_path_of_their_line_and_name_their_planner(finished):
    line = finished.lines["pair/turn", "cautious"]
    assert line["plan"] == "plans/pair/turn/cautious-7.json"
    plan = load_plan(finished.out / line["plan"])
    assert len(plan.times) == 10
    assert plan.planner["seed"] == 7
    assert plan.cost_rad == line["cost_rad"]


def test_the_settings_stand_beside_the_results(finished):
    settings = json.loads((finished.out / "settings.json").read_text())
    assert settings["schema"] == "mmp-bench/1"
    assert settings["planners"][:2] == [
        {"label": "quick", "name": "quick", "options": {"w": 2}},
        {"label": "cautious", "name": "quick", "options": {"steps": 9}},
    ]
    assert (settings["seed"], settings["time_limit_s"], settings["save_plans"]) == (7, 60.0, True)


def test_the_summary_counts_by_planner_and_names_the_report(finished):
    rows = {line.split()[0]: line.split() for line in finished.ran.out.splitlines()}
    assert rows["quick"][1:4] == ["1", "of", "1"]
    assert rows["helpless"][1:4] == ["0", "of", "1"]
    assert f"mmp report {finished.out}" in finished.ran.out


def test_progress_is_printed_in_lines_without_a_terminal(finished):
    assert "mmp bench: 8 to come" in finished.ran.err
    assert "mmp bench: 8 of 8 done; 1 error, 4 invalid, 2 solved, 1 timeout" in finished.ran.err


def test_instances_of_an_environment_and_planners_use_the_same_seeds(tmp_path):
    out, count = tmp_path / "out", 3
    words = ["--planners", "quick", "--count", count, "--seed", 5, "--robot", "panda", "--out", out, "--save-plans"]
    assert bench_runs.bench(tmp_path, "MultiArmCell-2", *words).code == 0
    lines = sorted(bench_runs.lines(out), key=lambda line: line["seed"])
    assert [(line["instance"], line["seed"]) for line in lines] == [(f"MultiArmCell-2/{k}", k) for k in (5, 6, 7)]
    assert {line["cell"] for line in lines} == {"MultiArmCell-2 panda"}
    plan = load_plan(next((out / "plans" / "MultiArmCell-2" / "6").iterdir()))
    start, goal = draw_instance(ring_cell(2, "panda"), seed=6)
    for arm in start:
        np.testing.assert_array_equal(plan.problem.start[arm], start[arm])
        np.testing.assert_array_equal(plan.problem.goal[arm], goal[arm])


def test_a_benchmark_takes_cell_files_and_instance_files_together(tmp_path):
    cell = tmp_path / "mine.yaml"
    cell.write_text(yaml.safe_dump(bench_runs.cell(name="mine")))
    words = ["--planners", "quick", "--count", "1", "--task", "reach", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, cell, *words).code == 0
    assert [line["instance"] for line in bench_runs.lines(tmp_path / "out")] == ["mine/0"]


def test_a_benchmark_keeps_the_tool_axes_that_an_instance_wants_kept(tmp_path):
    data = bad_files.good_instances()
    kept = {arm["name"]: {"upright": {"axis": [0, 0, 1], "within": 1e-3}} for arm in data["cell"]["arms"]}
    data["instances"] = [data["instances"][0], data["instances"][0] | {"name": "kept", "keep": kept}]
    (tmp_path / "kept.json").write_text(json.dumps(data))
    words = ["--planners", "quick", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, tmp_path / "kept.json", *words).code == 0
    bounded, free = bench_runs.lines(tmp_path / "out")
    assert (free["status"], bounded["status"]) == ("solved", "invalid")
    assert "from the world's z axis, and its bound is 0.001 rad" in bounded["message"]


def test_the_same_seed_gives_the_same_plans_on_any_number_of_workers(tmp_path):
    def plans(workers):
        out = tmp_path / f"{workers}"
        words = ["--planners", "ecbs,apf-ecbs", "--count", 3, "--workers", workers, "--save-plans", "--out", out]
        assert bench_runs.bench(tmp_path, "MultiArmCell-2", *words).code == 0
        return {path.relative_to(out): path.read_bytes() for path in (out / "plans").rglob("*.json")}

    alone, together = plans(1), plans(2)
    assert len(alone) == 6
    assert alone == together


def test_exact_checks_with_the_geoms_as_well(tmp_path):
    data = bench_runs.instances(tmp_path)
    words = ["--planners", "quick", "--count", 1, "--exact", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, data, *words).code == 0
    (line,) = bench_runs.lines(tmp_path / "out")
    assert line["status"] == "solved"


REFUSED = [
    (["MultiArmCel-2"], ["'MultiArmCel-2'", "Did you mean 'MultiArmCell-2'?"]),
    (["MultiArmCell-2", "MultiArmCell-2"], ["MultiArmCell-2/0", "in both"]),
    (["MultiArmCell-2", "--planners", "quik"], ["unknown planner 'quik'", "Did you mean 'quick'?"]),
    (["MultiArmCell-2", "--planners", "quick,quick"], ["'quick' twice", "other=quick"]),
    (["MultiArmCell-2", "--planners", "ecbs=quick"], ["'ecbs'", "another planner's name"]),
    (["MultiArmCell-2", "--planners", "a b=quick"], ["label 'a b'", "letters"]),
    (["MultiArmCell-2", "--planners", "quick", "--set", "quik.w=1"], ["'quik'", "Did you mean 'quick'?"]),
    (["MultiArmCell-2", "--planners", "quick", "--set", "w=1", "--set", "w=2"], ["w twice", "1", "2"]),
    (["MultiArmCell-2", "--planners", "quick", "--set", "quick.w"], ["quick.w", "key=value"]),
    (["MultiArmCell-2", "--planners", "quick", "--set", ".w=1"], ["'.w=1'", "[planner.]key=value"]),
    (
        ["MultiArmCell-2", "--planners", "quick", "--set", "quick.stpes=1"],
        ["no option 'stpes'", "Did you mean 'steps'?"],
    ),
    (["MultiArmCell-2", "--planners", "quick", "--set", f"w={400 * '9'}"], ["option 'w'", "a number up to"]),
    (["MultiArmCell-2", "--planners", "quick,helpless", "--set", "w=1"], ["'helpless'", "no option 'w'"]),
    (["MultiArmCell-2", "--count", "0"], ["--count", "'0'", "from 1"]),
    (["MultiArmCell-2", "--seed", "9223372036854775807", "--count", "2"], ["leaves no seeds for 2 instances"]),
    (["MultiArmCell-2", "--workers", "many"], ["--workers", "'many'", "from 1"]),
    (["MultiArmCell-2", "--time-limit", "0"], ["--time-limit", "'0'", "above 0"]),
    (["MultiArmCell-2", "--task", "raech"], ["unknown task 'raech'", "Did you mean 'reach'?"]),
    (["MultiArmCell-2", "--robot", "ur5"], ["unknown robot 'ur5'", "Did you mean 'ur5e'?"]),
    (["{instances}", "--robot", "ur5e"], ["--robot", "instance file"]),
    (["{instances}", "--planner", "quick"], ["'--planner'", "Did you mean '--planners'?"]),
    (["none.json"], ["none.json cannot be read"]),
    ([], ["SOURCE"]),
]


@pytest.mark.parametrize(("argv", "words"), REFUSED, ids=lambda value: " ".join(value)[:50])
def test_bad_usage_is_one_sentence_and_leaves_no_folder(tmp_path, argv, words):
    instances, out = bench_runs.instances(tmp_path), tmp_path / "out"
    ran = bench_runs.bench(tmp_path, *(instances if word == "{instances}" else word for word in argv), "--out", out)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("mmp: ")
    assert ran.err.count("\n") == 1
    for word in words:
        assert word in ran.err
    assert not out.exists()


def test_an_impossible_output_folder_is_named(tmp_path):
    source = bench_runs.many_instances(tmp_path, 1)
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        ran = bench_runs.bench(tmp_path, source, "--planners", "quick", "--out", out)
        assert ran.code == 2
        assert f"{out} cannot be" in ran.err
