"""The preset `paper` takes back every departure that the docs list with the paper's value."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from support import two_arms

from mmp_env.errors import MmpError
from mmp_planners import Status, describe, make
from mmp_planners.apf_ecbs import PAPER, ApfEcbs

PAGE = Path(__file__).parents[2] / "docs/explanation/paper.md"


def values_in_docs():
    """Returns the values of options in the last column of the table of design decisions."""
    table = PAGE.read_text().split("## Design decisions")[1].split("\n### ")[0]
    cells = [line.rstrip(" |").rsplit(" | ", 1)[-1] for line in table.splitlines() if line.startswith("| ")]
    return dict(pair for cell in cells for pair in re.findall(r"`(\w+)=([\w.-]+)`", cell))


def written(value):
    """Returns a value as `--set` takes it."""
    return (
        {True: "on", False: "off"}[value]
        if isinstance(value, bool)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )


def test_the_preset_is_the_table_of_departures():
    assert values_in_docs() == {name: written(value) for name, value in ApfEcbs.presets["paper"].items()}


def test_each_option_of_the_preset_has_a_line_of_the_paper_and_a_test():
    table = PAGE.read_text().split("### The paper's line and a test")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)=([\w.-]+)` \| ([lm]\. [\d–, ]+) \| `(\S+)::(\w+)` \|$", table, re.MULTILINE)
    assert {name: value for name, value, *_ in rows} == values_in_docs()
    for _, _, _, file, test in rows:
        assert f"def {test}(" in (PAGE.parents[2] / file).read_text(encoding="utf-8"), test


@pytest.mark.parametrize("name", ["apf-ecbs", "apf-ecbs-nf"])
def test_the_preset_sets_every_value_and_each_differs_from_the_default(name):
    ours, paper = make(name), make(name, preset="paper")
    for option, value in type(paper).presets["paper"].items():
        assert getattr(paper, option) == value != getattr(ours, option)
    for field in fields(paper):
        if field.name not in type(paper).presets["paper"]:
            assert getattr(paper, field.name) == getattr(ours, field.name)


def test_a_given_option_goes_before_the_preset():
    planner = make("apf-ecbs", preset="paper", step="normalised", restarts="on")
    assert (planner.step, planner.restarts, planner.distance) == ("normalised", True, "centre")
    assert make("apf-ecbs", preset="ours") == make("apf-ecbs")


def test_an_unknown_preset_and_a_planner_without_presets_are_refused_with_what_there_is():
    with pytest.raises(MmpError, match=r"'papers'.*Did you mean 'paper'\?.*ours, paper"):
        make("apf-ecbs", preset="papers")
    with pytest.raises(MmpError, match="has no option 'preset'"):
        make("ecbs", preset="paper")
    (option,) = (option for option in describe("apf-ecbs").options if option.name == "preset")
    assert (option.type, option.default) == ("str", "ours")


def test_the_preset_plans_and_its_plan_says_every_option():
    result = make("apf-ecbs", preset="paper").plan(two_arms.one_moves(), seed=0, time_limit=60.0)
    assert result.status is Status.SOLVED
    assert {name: result.plan.planner["options"][name] for name in PAPER} == PAPER


def test_without_normalised_steps_alpha_and_k_rep_act_and_with_them_only_step_rad_does():
    problem = two_arms.passing()

    def paths(**options):
        plan = make("apf-ecbs", **options).plan(problem, seed=1, time_limit=60.0).plan
        return np.concatenate([plan.positions[name] for name in problem.cell.arm_names], axis=1)

    def same(a, b):
        return a.shape == b.shape and (a == b).all()

    assert same(paths(), paths(alpha=1e-3, k_rep=64 * 0.05))
    assert not same(paths(), paths(step_rad=0.01))
    assert not same(paths(step="gradient"), paths(step="gradient", alpha=3e-8))
