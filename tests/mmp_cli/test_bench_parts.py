import io
from pathlib import Path

import pytest
from rich.console import Console

from mmp_cli.benchmark import cores
from mmp_cli.benchmark.cores import Core, available
from mmp_cli.benchmark.folder import plan_path
from mmp_cli.benchmark.job import Unit
from mmp_cli.benchmark.progress import BenchProgress, duration
from mmp_cli.benchmark.table import reasons
from mmp_cli.benchmark.worker_slot import grace_s
from mmp_env.files.writing import file_name


def unit(planner, k=0, instance="cell/a"):
    return Unit(instance=f"{instance}{k}", planner=planner, seed=k, source=0, item=k)


def line(planner, seconds, status="solved"):
    return {"planner": planner, "status": status, "planning_time_s": seconds, "check_time_s": None}


def test_the_remaining_time_follows_from_the_mean_time_of_each_planner():
    units = [unit("fast", 0), unit("fast", 1), unit("slow", 0), unit("slow", 1), unit("new", 0)]
    progress = BenchProgress(units, [line("slow", 10.0), line("slow", 20.0)], 2, Console(file=io.StringIO()))
    assert progress.left_s() == pytest.approx(5 * 15 / 2)  # planners without results count with the mean of the others
    progress.done(units[0], line("fast", 1.0))
    assert progress.left_s() == pytest.approx((1 + 2 * 15 + 8) / 2)


def test_before_the_first_result_no_remaining_time_is_shown():
    progress = BenchProgress([unit("a")], [], 1, Console(file=io.StringIO()))
    assert progress.left_s() is None
    assert progress.text() == ""


def test_on_a_terminal_a_bar_counts_units_by_status():
    file = io.StringIO()
    units = [unit("a", 0), unit("a", 1)]
    with BenchProgress(units, [line("a", 50.0)], 1, Console(file=file, force_terminal=True, width=150)) as progress:
        progress.done(units[0], line("a", 70.0, "timeout"))
    shown = file.getvalue()
    assert "2/3" in shown
    assert "about 60 s left; 1 solved, 1 timeout" in shown


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.2, "0 s"), (99, "99 s"), (600, "10 min"), (7200, "2 h 0 min"), (12000, "3 h 20 min")]
)
def test_durations_are_written_in_readable_units(seconds, text):
    assert duration(seconds) == text


def test_equal_errors_are_printed_once_with_their_number():
    lines = [
        {"planner": "a", "status": "error", "message": "boom", "instance": "x"},
        {"planner": "a", "status": "error", "message": "boom", "instance": "y"},
        {"planner": "b", "status": "error", "message": "boom", "instance": "y"},
        {"planner": "b", "status": "solved", "message": None, "instance": "z"},
    ]
    assert reasons(lines) == ["a: boom (x and 1 more)", "b: boom (y)"]


def test_reasons_of_invalid_instances_are_printed_once_and_after_the_errors():
    lines = [
        {"planner": planner, "status": "invalid", "message": why, "instance": name}
        for planner in ("a", "b")
        for name, why in (("x", "arms collide"), ("y", "arms collide"), ("z", "out of limits"))
    ]
    lines.append({"planner": "b", "status": "error", "message": "boom", "instance": "w"})
    assert reasons(lines) == ["b: boom (w)", "invalid: arms collide (x and 1 more)", "invalid: out of limits (z)"]


@pytest.mark.parametrize(("limit_s", "grace"), [(0.1, 2), (10, 10), (60, 30), (1800, 30), (float("inf"), 30)])
def test_a_planner_gets_its_time_limit_again_within_bounds_before_it_is_killed(limit_s, grace):
    assert grace_s(limit_s) == grace


def test_plans_stand_under_the_name_of_their_instance():
    assert plan_path(unit("apf-ecbs", 7)) == Path("plans/cell/a7/apf-ecbs-7.json")


@pytest.mark.parametrize("name", ["..", ".", ".hidden", "a\\b", "a:b", "Zelle ü", "x" * 101, "ü" * 100, "a*?"])
def test_a_strange_name_becomes_a_tame_file_name_of_its_own(name):
    tame = file_name(name)
    assert tame != name
    assert not tame.startswith(".")
    assert len(tame.encode()) <= 120
    assert not set(tame) & set('/\\:*?"<>|')
    assert file_name(name + "x") != tame


def test_a_core_is_claimed_by_one_at_a_time_and_free_again_afterwards(monkeypatch, tmp_path):
    monkeypatch.setattr(cores, "_NAME", f"\0{tmp_path}-{{}}")  # other tests claim cores at the same time
    first, second = Core(), Core()
    try:
        assert first.number is None or first.number in available()
        assert first.number is None or first.number != second.number
    finally:
        first.free()
    third = Core()
    try:
        assert first.number is None or third.number == first.number
    finally:
        second.free()
        third.free()
