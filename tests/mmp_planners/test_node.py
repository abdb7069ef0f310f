"""Nodes of the conflict tree: cost, bound and conflicts of their paths."""

import numpy as np
import pytest
from support.arms_on_a_line import ArmsOnALine, node, path

from mmp_env import core
from mmp_planners.conflict_tree.constraints import Branch, ConflictInterval
from mmp_planners.conflict_tree.node import settled_paths


def fields(found: ConflictInterval):
    return found.a, found.b, found.first, found.last


def test_cost_is_the_length_of_the_paths_and_the_bound_their_length_before_repulsion():
    n = node(0, (0, 1, 2), (5, 5, 4), bounds=[1.5, 1.0])
    assert (n.cost, n.lower_bound) == (3.0, 2.5)


def test_conflicts_are_counted_as_arm_arm_step():
    n = node(0, (0, 1, 1), (2, 1, 1), (0, 7, 8))
    assert n.conflict_count == 3
    assert {pair: steps.tolist() for pair, steps in n.conflicts.items()} == {(0, 1): [1, 2], (0, 2): [0]}


def test_the_first_conflict_is_the_earliest_and_then_of_the_first_pair():
    assert fields(node(0, (0, 1), (2, 1), (3, 1)).first_conflict()) == (0, 1, 1, 1)
    assert fields(node(0, (0, 1, 5), (2, 1, 6), (2, 4, 4)).first_conflict()) == (1, 2, 0, 0)


def test_an_isolated_conflict_is_of_arms_in_the_fewest_pairs_and_then_the_earliest():
    n = node(0, *[(k,) for k in range(7)])
    n.conflicts = {pair: np.array([when]) for pair, when in [((0, 1), 1), ((1, 2), 0), ((3, 4), 7), ((5, 6), 5)]}
    assert fields(n.first_conflict()) == (1, 2, 0, 0)
    assert fields(n.isolated_conflict()) == (5, 6, 5, 5)
    del n.conflicts[3, 4], n.conflicts[5, 6]
    assert fields(n.isolated_conflict()) == (1, 2, 0, 0)


@pytest.mark.parametrize(
    ("instants", "first", "last"),
    [
        ([3, 4, 5, 8, 9], 3, 5),
        ([3], 3, 3),
        ([2.5, 3, 4], 2.5, 4),
        ([2.5, 4], 2.5, 2.5),
        ([0, 1, 2, 3], 0, 3),
    ],
)
def test_a_conflict_lasts_as_long_as_no_step_is_left_out(instants, first, last):
    n = node(0, (0,), (1,))
    n.conflicts = {(0, 1): np.array(instants, dtype=float)}
    assert fields(n.first_conflict()) == (0, 1, first, last)


@pytest.mark.parametrize(
    ("pairs", "common"),
    [
        ([(0, 1)], [0, 1]),
        ([(0, 1), (1, 2)], [1]),
        ([(0, 1), (1, 2), (1, 4)], [1]),
        ([(0, 1), (2, 3)], []),
        ([(0, 1), (1, 2), (0, 2)], []),
        ([], []),
    ],
)
def test_common_arms_are_in_every_conflicting_pair(pairs, common):
    n = node(0, *[(k,) for k in range(5)])
    n.conflicts = {pair: np.array([1.0]) for pair in pairs}
    assert n.common_arms() == common


def test_a_replaced_path_is_tested_with_its_own_pairs_only():
    n = node(0, (0, 1), (2, 1), (2, 3), (4, 3))
    assert set(n.conflicts) == {(0, 1), (1, 2), (2, 3)}
    asked = []

    class Asked(ArmsOnALine):
        def conflicts(self, paths, pairs):
            asked.extend(pairs)
            return super().conflicts(paths, pairs)

    paths, conflicts = n.replaced(Asked((), (), (), ()), 1, path(4, 9))
    assert asked == [(0, 1), (1, 2), (1, 3)]
    assert {pair: steps.tolist() for pair, steps in conflicts.items()} == {(1, 3): [0], (2, 3): [1]}
    assert [new is old for new, old in zip(paths, n.paths, strict=True)] == [True, False, True, True]
    assert set(n.conflicts) == {(0, 1), (1, 2), (2, 3)}, "the node itself stays as it is"


def test_the_instants_of_a_conflict_interval_are_its_begin_its_middle_or_all():
    long, short = ConflictInterval(a=0, b=1, first=3.0, last=8.0), ConflictInterval(a=0, b=1, first=2.5, last=2.5)
    assert long.instants("begin") == [3.0]
    assert long.instants("middle") in ([5.0], [6.0])
    assert long.instants("all") == [3.0, *long.instants("middle"), 8.0]
    assert all(short.instants(where) == [2.5] for where in ("begin", "middle", "all"))


def test_a_child_has_the_paths_of_its_parent_and_a_branch_that_is_pending():
    parent = node(7, (0, 1), (2, 1), bounds=[1.0, 0.5])
    old, new = (core.Constraint.ball(np.zeros(1), 0.1, k, k + 1) for k in (0, 5))
    parent.constraints, parent.kinds = ((old,), ()), (2,)
    branch = Branch(arm=0, constraints=(new,), description="", kind=3)
    child = parent.child(branch)
    assert (child.parent, child.id, child.pending, child.kinds) == (7, -1, branch, (2, 3))
    assert child.constraints == ((old, new), ())
    assert (child.paths, child.bounds, child.conflicts) == (parent.paths, parent.bounds, parent.conflicts)


def test_the_share_of_a_kind_is_that_of_the_branches_from_the_root():
    n = node(0, (0,), (1,))
    assert n.share(0) == 0.0
    n.kinds = (1, 0, 1, 1)
    assert (n.share(0), n.share(1), n.share(2)) == (0.25, 0.75, 0.0)


def test_cost_bound_and_conflicts_follow_an_update_of_the_paths():
    n = node(0, (0, 1), (2, 1))
    assert (n.cost, n.lower_bound, n.conflict_count) == (2.0, 2.0, 1)
    n.update(paths=(path(0, 3), n.paths[1]), bounds=(3.0, 1.0), conflicts={})
    assert (n.cost, n.lower_bound, n.conflict_count) == (4.0, 4.0, 0)


def test_arms_in_no_conflict_keep_their_paths():
    closest = node(1, *[(k + 0.5,) for k in range(5)])
    closest.conflicts = {(0, 4): np.array([1.0])}
    assert settled_paths(closest) == {k: closest.paths[k] for k in (1, 2, 3)}
    closest.conflicts = {}
    assert settled_paths(closest) == dict(enumerate(closest.paths))
