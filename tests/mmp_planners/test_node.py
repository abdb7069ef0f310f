"""What a node of the conflict tree knows of its paths."""

import numpy as np
import pytest
from arms_on_a_line import ArmsOnALine, node, path

from mmp_planners.constraints import Meeting


def meeting(found: Meeting):
    return found.a, found.b, found.first, found.last


def test_cost_is_the_way_of_the_paths_and_the_bound_that_before_repulsion():
    n = node(0, (0, 1, 2), (5, 5, 4), bounds=[1.5, 1.0])
    assert (n.cost, n.lower_bound) == (3.0, 2.5)


def test_conflicts_are_counted_as_arm_arm_step():
    n = node(0, (0, 1, 1), (2, 1, 1), (0, 7, 8))
    assert n.conflict_count == 3
    assert {pair: steps.tolist() for pair, steps in n.conflicts.items()} == {(0, 1): [1, 2], (0, 2): [0]}


def test_the_first_conflict_is_the_earliest_and_then_of_the_first_pair():
    assert meeting(node(0, (0, 1), (2, 1), (3, 1)).first_conflict()) == (0, 1, 1, 1)
    assert meeting(node(0, (0, 1, 5), (2, 1, 6), (2, 4, 4)).first_conflict()) == (1, 2, 0, 0)


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
    assert meeting(n.first_conflict()) == (0, 1, first, last)


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


def test_another_path_is_looked_at_with_its_own_pairs_only():
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


def test_an_instant_of_a_meeting_is_its_begin_its_middle_or_all_of_it():
    long, short = Meeting(a=0, b=1, first=3.0, last=8.0), Meeting(a=0, b=1, first=2.5, last=2.5)
    assert long.instants("begin") == [3.0]
    assert long.instants("middle") in ([5.0], [6.0])
    assert long.instants("all") == [3.0, *long.instants("middle"), 8.0]
    assert all(short.instants(where) == [2.5] for where in ("begin", "middle", "all"))
