"""The preset `paper` takes back every departure that the docs list with the paper's value."""

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from support import two_arms

from mmp_env.errors import MmpError
from mmp_env.events import ignore
from mmp_planners import Status, describe, make
from mmp_planners.apf_ecbs import PAPER, ApfEcbs
from mmp_planners.conflict_tree.constraints.named import constraint_kind
from mmp_planners.conflict_tree.fast_track import NoFastTrack, RepulsionOfSeveralArms, RepulsiveFastTrack
from mmp_planners.conflict_tree.repulsion import RepulsiveModification
from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.counts import TreeCounts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.portfolio.run import Run
from mmp_planners.tree_planner import LOW_LEVEL, Parts

PAGE = Path(__file__).parents[2] / "docs/explanation/paper.md"


PAGE_TEXT = PAGE.read_text(encoding="utf-8")
CHECKED_LINE = re.compile(r"^\| `(\w+)=([\w.-]+)` \| ([lm]\. [\d–, ]+) \| `(\S+)::(\w+)` \|$", re.MULTILINE)
"""An option with its value, the line of a listing, and the file and name of a test."""


def design_decisions():
    """Returns the subject and the last column of each row of the table of design decisions."""
    table = PAGE_TEXT.split("## Design decisions")[1].split("\n### ")[0]
    rows = [re.split(r"(?<!\\)\|", line) for line in table.splitlines() if line.startswith("| ")]
    return [(row[1].strip(), row[-2].strip()) for row in rows if row[1].strip() != "subject"]


def values_in_docs():
    """Returns the values of options in the last column of the table of design decisions."""
    return dict(pair for _, cell in design_decisions() for pair in re.findall(r"`(\w+)=([\w.-]+)`", cell))


def as_in_the_paper(heading):
    """Returns the rows of options with a line of the listing: those of the preset, or those of the defaults."""
    section = PAGE_TEXT.split("### The line and a test")[1].split("\n## ")[0]
    return CHECKED_LINE.findall(section.split("These have the paper's value by default")[heading == "defaults"])


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


@pytest.mark.parametrize(("subject", "last"), design_decisions())
def test_each_design_decision_names_its_option_or_says_that_it_has_none(subject, last):
    assert last.startswith("no option") or re.search(r"`(--)?[\w.]+(=[\w.-]+)?`", last), subject
    known = {option.name for option in describe("apf-ecbs").options} | {"margin", "task"}
    assert set(re.findall(r"`(?:--)?(\w+)", last)) <= known, subject


def test_each_option_of_the_preset_has_a_line_of_the_listing_and_a_test():
    rows = as_in_the_paper("preset")
    assert {name: value for name, value, *_ in rows} == values_in_docs()
    for _, _, _, file, test in rows:
        assert f"def {test}(" in (PAGE.parents[2] / file).read_text(encoding="utf-8"), test


def test_each_option_that_is_as_in_the_paper_by_default_has_a_line_and_a_test():
    rows = as_in_the_paper("defaults")
    assert len(rows) == 9
    assert not {name for name, *_ in rows} & PAPER.keys()
    for name, value, _, file, test in rows:
        assert written(getattr(make("apf-ecbs"), name)) == value
        assert f"def {test}(" in (PAGE.parents[2] / file).read_text(encoding="utf-8"), test


@pytest.mark.parametrize("name", ["apf-ecbs", "apf-ecbs-nf"])
def test_an_option_whose_text_marks_a_value_as_paper_literal_has_that_value_in_the_table(name):
    marked = {option.name: option.doc for option in describe(name).options if "(paper-literal)" in option.doc}
    rows = {row[0]: row[1] for heading in ("preset", "defaults") for row in as_in_the_paper(heading)}
    assert marked
    for option, doc in marked.items():
        assert re.search(rf"\b{rows[option]} \(paper-literal\)", doc), option


def test_the_preset_hands_its_values_to_the_parts_and_the_low_level():
    planner = make("apf-ecbs", preset="paper")
    modification = RepulsiveModification(
        distance="centre", step="gradient", floor=0.0, cap=0.0, stretch=0.0, early_stop=False
    )
    assert planner.parts(0) == Parts(
        selection=Focal(w=1.5),
        branching=constraint_kind("vertex", pad=0.25, radius=0.2, sphere_radius=0.1),
        modification=modification,
        fast_track=RepulsiveFastTrack(modification=modification, literal=True),
    )
    without = make("apf-ecbs-nf", preset="paper")
    assert (without.parts(0).modification, without.parts(0).fast_track) == (modification, NoFastTrack())
    for each in (planner, without):
        assert each.low_level() == SiRrtStar(
            eta=0.8,
            iterations=LOW_LEVEL.iterations,
            direct=False,
            improve=200,
            shortcuts=0,
            static_tree=False,
        )
        run = Run.begin(each.name, each, two_arms.passing(), 0, 60.0)
        search = each.grow(run, TreeCounts(), ignore)
        assert (search.restarts, search.patience) == (False, 1_000_000)


def test_the_fast_track_is_tried_on_children_unless_it_waits_for_expansion():
    for critical in ("one", "cover", "all"):
        assert make("apf-ecbs", critical_arms=critical).parts(0).fast_track.on_children
        assert not make("apf-ecbs", critical_arms=critical, fast_track_at="expansion").parts(0).fast_track.on_children


def test_the_last_resort_repels_arms_that_have_arrived_unless_all_repulsion_does():
    planners = [make("apf-ecbs"), make("cbs", repulsion="fast-track")]
    for parts in (planner.parts(0) for planner in planners):
        assert parts.fast_track.last_resort == replace(parts.modification, parked_yield=True) != parts.modification
    shortened = make("apf-ecbs", shorten_paths=True).parts(0).fast_track.last_resort
    assert shortened.modification.parked_yield
    for options in ({"last_resort": False}, {"parked_yield": True}):
        assert make("apf-ecbs", **options).parts(0).fast_track.last_resort is None


def test_discarded_misses_are_handed_to_the_fast_track_of_several_arms():
    for misses, kept in (("kept", True), ("discarded", False)):
        planner = make("apf-ecbs", preset="paper", critical_arms="cover", misses=misses)
        assert planner.parts(0).fast_track == RepulsionOfSeveralArms(
            modification=planner.modification(), literal=True, cover=True, keep_misses=kept
        )


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
