"""`scripts/bench_deadlines.py`: limits that end a run count, and planners are at work until a long limit."""

import importlib
import json
import time

import pytest
from support import checkout_scripts

from mmp_env import draw_problem, find_cell
from mmp_planners import PlanResult, Status, make, names
from mmp_planners.registry import is_foreign

LIMITS_S = [0.001, 0.1, 10.0]


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("bench_deadlines")


class Stub:
    """A planner that reports whether a limit up to `hit_s` ended it, and takes `takes_s`."""

    def __init__(self, hit_s=0.0, takes_s=0.0):
        self.hit_s, self.takes_s = hit_s, takes_s

    def plan(self, problem, *, seed, time_limit):
        time.sleep(self.takes_s)
        return PlanResult(status=Status.TIMEOUT, stats={"deadline_hit": time_limit <= self.hit_s})


def figure_of(bench, monkeypatch, capsys, stub):
    monkeypatch.setattr(bench, "make", lambda name, **options: stub)
    *_, unused_s = bench.show("lateness", "stub", [None], LIMITS_S)
    return json.loads(capsys.readouterr().out) | {"unused_s": unused_s}


def test_a_run_counts_if_it_says_that_the_limit_ended_it(bench, monkeypatch, capsys):
    figure = figure_of(bench, monkeypatch, capsys, Stub(hit_s=0.1))
    assert (figure["runs"], figure["reached_limit"], figure["longest_limit_s"]) == (12, 11, 0.1)
    assert figure["unused_s"] == [10.0]


def test_a_run_counts_if_it_is_late(bench, monkeypatch, capsys):
    figure = figure_of(bench, monkeypatch, capsys, Stub(takes_s=0.02))
    assert (figure["runs"], figure["reached_limit"], figure["longest_limit_s"]) == (12, 10, 0.001)
    assert figure["unused_s"] == [0.1, 10.0]
    assert figure["worst_ms"] >= figure["value"] >= 19
    assert figure["worst_at_limit_s"] == 0.001


@pytest.mark.parametrize(
    ("ring", "crowd", "code"),
    [((5.0, 20.0), (20.0, 20.0), 0), ((5.1, 6.0), (0.0, 0.0), 1), ((0.0, 20.1), (0.0, 0.0), 1), ((0, 0), (0, 20.1), 1)],
)
def test_a_planner_that_is_too_late_ends_the_script_with_1(bench, monkeypatch, ring, crowd, code):
    shown = []

    def show(name, planner, problems, limits):
        shown.append(name)
        return (*(crowd if "crowd" in name else ring), []) if planner == "ecbs" else (0.0, 0.0, [])

    monkeypatch.setattr(bench, "show", show)
    monkeypatch.setattr("sys.argv", ["bench_deadlines.py", "ecbs", "auto", "--count", "1", "--crowd", "1"])
    assert bench.main() == code
    assert len(shown) == 4


@pytest.mark.parametrize(
    ("hit_s", "sentences"),
    [
        (1.0, []),
        (0.3, ["ring-8-panda: no run was ended by the limits 1 s", "crowd: no run was ended by the limits 1 s"]),
    ],
)
def test_a_limit_that_ends_no_run_ends_the_script_with_1_and_a_sentence(bench, monkeypatch, capsys, hit_s, sentences):
    monkeypatch.setattr(bench, "make", lambda name, **options: Stub(hit_s=hit_s))
    monkeypatch.setattr(bench, "crowded", lambda problem: problem)
    monkeypatch.setattr("sys.argv", ["bench_deadlines.py", "ecbs", "--count", "1", "--crowd", "1"])
    assert bench.main() == bool(sentences)
    assert capsys.readouterr().err.splitlines() == [f"ecbs, {sentence}" for sentence in sentences]


def test_only_long_limits_have_options(bench, monkeypatch):
    limits = []

    def made(name, **options):
        limits.append(options)
        return Stub()

    monkeypatch.setattr(bench, "make", made)
    bench.show("lateness", "auto", [None], [0.03, 0.1])
    assert limits == [{}] * 11 + [bench.BUSY["auto"]]


def test_every_planner_has_options(bench):
    assert set(bench.BUSY) == {name for name in names() if not is_foreign(name)}


@pytest.mark.parametrize("name", [name for name in names() if not is_foreign(name)])
def test_the_limit_ends_a_planner_with_these_options(bench, name):
    problem = draw_problem(find_cell("ring-8-panda"), seed=0)
    assert make(name, **bench.BUSY[name]).plan(problem, seed=0, time_limit=0.5).stats["deadline_hit"]
