"""All constraint kinds on real conflicts: forbidden motions, and paths that remain."""

import gc
import weakref

import numpy as np
import pytest
from reference.clearance import cloud, gaps
from support.first_conflicts import CASES, conflict

from mmp_env import core
from mmp_env.errors import MmpError, UnknownNameError
from mmp_planners.conflict_tree.constraints import (
    INSTANTS,
    AvoidPath,
    AvoidState,
    ConflictInterval,
    ConstraintKind,
    EitherArm,
    EveryKind,
    PathPriority,
    Sphere,
    Split,
    StepPriority,
    Vertex,
)
from mmp_planners.conflict_tree.constraints.named import KINDS, constraint_kind, constraint_kinds

every_kind = pytest.mark.parametrize("name", KINDS)
every_instant = pytest.mark.parametrize("instant", INSTANTS)


every_case = pytest.mark.parametrize("case", CASES)


def branches(name, case, instant="begin"):
    return constraint_kind(name, pad=0.25).branches(*conflict(case), instant)


def breaks(context, path, constraints):
    return core.breaks_constraint(context.core, path.motion, list(constraints), context.conflict_distance)


def test_the_cases_have_the_conflicts_of_their_names():
    assert conflict("between two steps")[2].first % 1 > 0
    assert conflict("in the first moments")[2].first == 1
    _, paths, interval = conflict("parked")
    assert paths[1].last == 0
    assert interval.first > 0
    assert len(conflict("in the ring")[0].names) == 4


@every_kind
@every_case
@every_instant
def test_each_branch_forbids_its_arm_the_conflict_it_was_made_from(name, case, instant):
    context, paths, interval = conflict(case)
    made = branches(name, case, instant)
    assert {branch.arm for branch in made} == {interval.a, interval.b}
    for branch in made:
        assert breaks(context, paths[branch.arm], branch.constraints)


@every_kind
@pytest.mark.parametrize("case", ["passing", "parked", "in the ring"])
def test_a_child_has_a_path_that_keeps_its_constraints(name, case):
    context, _, _ = conflict(case)
    found = [context.low_level(branch.arm, branch.constraints, 1)[0] for branch in branches(name, case)]
    assert any(found)
    for branch, path in zip(branches(name, case), found, strict=True):
        assert path is None or not core.breaks_constraint(
            context.core, path.motion, list(branch.constraints), 0.5 * context.conflict_distance
        )


@every_kind
def test_the_description_of_a_branch_names_arm_and_time(name):
    said = [branch.description for branch in branches(name, "passing")]
    assert len(set(said)) == 2
    assert {words.split()[0] for words in said} == {"left", "right"}
    assert name == "priority-path" or all(" s" in words for words in said)


def test_only_combinations_with_split_are_complete():
    assert [name for name in KINDS if constraint_kind(name, pad=0.25).complete] == ["split"]
    several = constraint_kinds("vertex-0.1+split", pad=0.25)
    assert EveryKind(kinds=several).complete
    assert not EveryKind(kinds=several[:1]).complete


@every_kind
def test_the_names_are_those_of_constraint_kinds(name):
    assert isinstance(constraint_kind(name, pad=0.25), ConstraintKind)


def test_a_name_makes_the_kind_with_its_options():
    made = {name: constraint_kind(name, pad=0.5, radius=0.1, sphere_radius=0.05) for name in KINDS}
    sided = {name: kind.kind for name, kind in made.items() if isinstance(kind, EitherArm)}
    assert sided == {
        "avoid-state": AvoidState(pad=0.5),
        "vertex": Vertex(radius=0.1),
        "avoid-path": AvoidPath(),
        "sphere": Sphere(radius=0.05),
        "priority": StepPriority(),
        "priority-path": PathPriority(),
    }
    assert made["split"] == Split()


def test_several_kinds_are_named_with_plus_and_radii_with_a_dash():
    kinds = constraint_kinds("split+avoid-state+sphere-0.05+sphere-0.2+vertex-0.1", pad=0.5)
    rest = [AvoidState(pad=0.5), Sphere(radius=0.05), Sphere(radius=0.2), Vertex(radius=0.1)]
    assert kinds == (Split(), *(EitherArm(kind=kind) for kind in rest))


@pytest.mark.parametrize(
    ("names", "error", "message"),
    [
        ("splitt", UnknownNameError, "unknown constraint kind 'splitt'. Did you mean 'split'"),
        ("split+", UnknownNameError, "unknown constraint kind ''"),
        ("split+split", MmpError, "'split\\+split' name one kind twice"),
        ("sphere-big", MmpError, "'sphere-big': the radius must be a positive number"),
        ("vertex--1", MmpError, "'vertex--1': the radius"),
        ("sphere-inf", MmpError, "'sphere-inf': the radius"),
    ],
)
def test_a_malformed_list_of_kinds_is_refused_with_a_sentence(names, error, message):
    with pytest.raises(error, match=message):
        constraint_kinds(names, pad=0.25)


def test_branches_of_several_kinds_come_side_by_side_with_the_numbers_of_their_kinds():
    made = EveryKind(kinds=constraint_kinds("split+vertex", pad=0.25)).branches(*conflict("passing"), "begin")
    assert [branch.kind for branch in made] == [0, 0, 1, 1]
    assert [branch.arm for branch in made] == [
        branch.arm for name in ("split", "vertex") for branch in branches(name, "passing")
    ]


@pytest.mark.parametrize("case", ["passing", "parked", "in the ring"])
def test_the_point_of_contact_is_within_the_margin_of_both_arms(case):
    context, paths, interval = conflict(case)
    (contact,) = context.contacts(interval.a, paths[interval.a], interval.b, paths[interval.b], (interval.first,))
    cell = context.problem.cell
    own = [cloud(cell, cell.arms[arm], paths[arm].at(interval.first)).moving for arm in (interval.a, interval.b)]
    between = gaps(*own)
    assert contact.gap == pytest.approx(between.min(), abs=1e-9)
    assert contact.gap < context.conflict_distance
    s, t = np.unravel_index(between.argmin(), between.shape)
    assert contact.links == (own[0].parts[s], own[1].parts[t])
    for arm, k in zip(own, (s, t), strict=True):
        off = np.linalg.norm(arm.centers[k] - contact.point) - arm.radii[k]
        assert off == pytest.approx(contact.gap / 2, abs=1e-9), "halfway between the two surfaces"


def test_a_context_keeps_its_last_contacts():
    context, paths, interval = conflict.__wrapped__("passing")  # a new context, not the cached one
    question = (interval.a, paths[interval.a], interval.b, paths[interval.b], (interval.first,))
    first = context.contacts(*question)
    assert context.contacts(*question) is first
    assert context.contacts(*question[:-1], (interval.first, interval.first + 1))[0].gap == first[0].gap
    run, path = weakref.ref(context), weakref.ref(paths[interval.a])
    del context, paths, question
    gc.collect()
    assert (run(), path()) == (None, None)


def test_the_avoided_path_is_that_of_the_conflict_and_one_step_on_both_sides():
    context, paths, _ = conflict("passing")
    inside = ConflictInterval(a=0, b=1, first=9.0, last=12.0)
    made = AvoidPath().forbid(context, paths, inside, 0, "begin")
    assert (made[0].start, made[-1].end) == (8, 13)
    made = StepPriority().forbid(context, paths, inside, 0, "middle")
    assert (made[0].start, made[-1].end) == (9, 11)
    made = PathPriority().forbid(context, paths, inside, 0, "begin")
    assert (made[0].start, made[-1].end) == (0, core.FOREVER)
    at_goal = ConflictInterval(a=0, b=1, first=9.0, last=float(paths[1].last))
    assert AvoidPath().forbid(context, paths, at_goal, 0, "begin")[-1].end == core.FOREVER


def test_a_part_that_ends_before_the_conflict_is_left_out_where_the_start_breaks_it():
    """The arms begin almost in contact, so forbidding the first step would leave no child."""
    context, paths, interval = conflict("in the first moments")
    assert interval.first == 1
    assert AvoidPath().forbid(context, paths, interval, 0, "begin")[0].start == 1
    later = ConflictInterval(a=0, b=1, first=0.5, last=interval.last)
    assert AvoidPath().forbid(context, paths, later, 0, "begin")[0].start == 0, (
        "it is over after the conflict has begun"
    )


def test_the_sphere_opens_with_the_conflict_where_the_start_touches_it():
    context, paths, interval = conflict("in the first moments")
    ((wide,), (narrow,)) = (Sphere(radius=r).forbid(context, paths, interval, 0, "begin") for r in (0.2, 0.001))
    assert (wide.start, narrow.start) == (1, 0)
    assert wide.end == narrow.end == 2
