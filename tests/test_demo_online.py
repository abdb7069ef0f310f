"""`scripts/demo_online.py` and `scripts/bench_online.py`: their answers are valid, nothing meets an arm that moves."""

import json

from support import checkout_scripts

from mmp_env import check_plan, load_plan


def test_the_demonstration_checks_its_answers_and_executes_them_without_contact(tmp_path):
    words = ("--cell", "ring-2", "--seconds", 6, "--within", 0.2, "--seed", 3, "--out", tmp_path / "online.json")
    done = checkout_scripts.run("demo_online.py", *words)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "check      2 of 2 answers valid" in done.stdout
    assert "no contact" in done.stdout
    plan = load_plan(tmp_path / "online.json")
    assert [body.name for body in plan.problem.cell.obstacles if body.speed > 0] == ["box"]
    assert check_plan(plan).valid


def test_the_benchmark_measures_calls():
    done = checkout_scripts.run("bench_online.py", "ring-2", "--calls", 40)
    assert done.returncode == 0, done.stderr
    line = json.loads(done.stdout)
    assert line["name"] == "replan_ring-2"
    assert line["calls"] == 40
    assert line["unproved"] == 0
    assert line["clearance_moving_mm"] >= 2.0
    assert 0.0 < line["continuations"] <= 1.0


def test_wrong_arguments_are_refused_in_one_sentence():
    for words in (
        ("demo_online.py", "--cell", "rng-8"),
        ("bench_online.py", "rng-8"),
        ("demo_online.py", "--seconds", "x"),
    ):
        done = checkout_scripts.run(*words)
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
