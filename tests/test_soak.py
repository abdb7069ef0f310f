"""`scripts/soak.py`: it reports memory that a planner or the environment keeps."""

import contextlib
import importlib
import json
import sys

import gymnasium
import pytest
from support import checkout_scripts

MEGABYTE = 1_000_000


@pytest.fixture
def soak(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("soak")


class Leak:
    """A planner and an environment that keep a number of bytes for each plan, and for each episode of one step."""

    def __init__(self, planner_bytes, env_bytes):
        self.planner_bytes, self.env_bytes, self.kept = planner_bytes, env_bytes, []
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def plan(self, problem, *, seed, time_limit):
        self.kept.append(b"x" * self.planner_bytes)

    def reset(self, *, seed):
        self.kept.append(b"x" * self.env_bytes)

    def step(self, action):
        return None, 0.0, True, False, {}


@pytest.mark.parametrize(("size", "leaks"), [(0, False), (MEGABYTE, True)])
def test_growth_counts_what_a_call_keeps(soak, capsys, size, leaks):
    kept = []
    growth = soak.show("soak", "calls", lambda _: kept.append(b"x" * size), 40)
    assert (growth > soak.MOST) is leaks
    figure = json.loads(capsys.readouterr().out)
    assert figure["name"] == "soak_growth"
    assert figure["value"] == pytest.approx(growth, rel=1e-3)
    assert (figure["after_mb"] - figure["before_mb"] > 35) is leaks


@pytest.mark.parametrize(
    ("planner_bytes", "env_bytes", "code"),
    [(0, 0, 0), (MEGABYTE, 0, 1), (0, MEGABYTE, 1)],
    ids=["none", "plans", "env"],
)
def test_it_ends_with_1_if_a_planner_or_the_environment_leaks(
    soak, monkeypatch, capsys, planner_bytes, env_bytes, code
):
    leak = Leak(planner_bytes, env_bytes)
    monkeypatch.setattr(soak, "make", lambda name: leak)
    monkeypatch.setattr(soak.gymnasium, "make", lambda name, cell: contextlib.nullcontext(leak))
    monkeypatch.setattr(sys, "argv", ["soak.py", "--cell", "ring-2", "--plans", "40", "--episodes", "40"])
    assert soak.main() == code
    plans, episodes = (json.loads(line)["value"] for line in capsys.readouterr().out.splitlines())
    assert (plans > soak.MOST) == bool(planner_bytes)
    assert (episodes > soak.MOST) == bool(env_bytes)
