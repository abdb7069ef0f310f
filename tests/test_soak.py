"""`scripts/soak.py`: it reports memory that a planner or the environment keeps."""

import contextlib
import importlib
import json
import sys
from types import SimpleNamespace

import gymnasium
import pytest
from support import checkout_scripts

from mmp_planners import names

MEGABYTE = 1_000_000


@pytest.fixture
def soak(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("soak")


class Leak:
    """A planner and an environment that keep a number of bytes for each plan, and for each episode of one step.

    The planner finds a plan in every run, or in none.
    """

    def __init__(self, planner_bytes=0, env_bytes=0, solves=True):
        self.planner_bytes, self.env_bytes, self.kept = planner_bytes, env_bytes, []
        self.result = SimpleNamespace(plan=object() if solves else None)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def plan(self, problem, *, seed, time_limit):
        self.kept.append(b"x" * self.planner_bytes)
        return self.result

    def reset(self, *, seed):
        self.kept.append(b"x" * self.env_bytes)

    def step(self, action):
        return None, 0.0, True, False, {}


@pytest.mark.parametrize(("size", "leaks"), [(0, False), (MEGABYTE, True)])
def test_growth_counts_what_a_call_keeps(soak, capsys, size, leaks):
    kept = []
    growth, _ = soak.show("soak", "calls", lambda _: kept.append(b"x" * size) or "caller", 40)
    assert (growth > soak.MOST) is leaks
    figure = json.loads(capsys.readouterr().out)
    assert figure["name"] == "soak_growth"
    assert figure["value"] == pytest.approx(growth, rel=1e-3)
    assert (figure["after_mb"] - figure["before_mb"] > 35) is leaks


def replace(soak, monkeypatch, make, env):
    """Replaces planners and environment of the script, and asks it for 40 plans and 40 episodes."""
    monkeypatch.setattr(soak, "make", make)
    monkeypatch.setattr(soak.gymnasium, "make", lambda name, cell: contextlib.nullcontext(env))
    monkeypatch.setattr(sys, "argv", ["soak.py", "--cell", "ring-2", "--plans", "40", "--episodes", "40"])


@pytest.mark.parametrize(
    ("planner_bytes", "env_bytes", "code"),
    [(0, 0, 0), (MEGABYTE, 0, 1), (0, MEGABYTE, 1)],
    ids=["none", "plans", "env"],
)
def test_it_ends_with_1_if_a_planner_or_the_environment_leaks(
    soak, monkeypatch, capsys, planner_bytes, env_bytes, code
):
    leak = Leak(planner_bytes, env_bytes)
    replace(soak, monkeypatch, lambda name: leak, leak)
    assert soak.main() == code
    plans, episodes = (json.loads(line)["value"] for line in capsys.readouterr().out.splitlines())
    assert (plans > soak.MOST) == bool(planner_bytes)
    assert (episodes > soak.MOST) == bool(env_bytes)


@pytest.mark.parametrize(
    ("unsolving", "plans", "code"), [((), 40, 0), (names()[:1], 40, 1), (names()[:-1], 14, 1), (names(), 0, 1)]
)
def test_only_plans_count_and_a_planner_without_one_ends_the_script_with_1(
    soak, monkeypatch, capsys, unsolving, plans, code
):
    replace(soak, monkeypatch, lambda name: Leak(solves=name not in unsolving), Leak())
    assert soak.main() == code
    out, err = capsys.readouterr()
    figure = json.loads(out.splitlines()[0])
    solving = [name for name in names() if name not in unsolving]
    assert (figure["plans"], figure["runs"] <= 160) == (plans, True)
    assert figure["solved"].keys() == set(names())
    assert sum(figure["solved"].values()) == plans
    assert [name for name, count in figure["solved"].items() if count] == solving
    few = [] if plans == 40 else [f"only {plans} of 40 plans were made"]
    assert err.splitlines() == [f"{name} made no plan in 0.1 s" for name in unsolving] + few
