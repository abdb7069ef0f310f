"""Eager and lazy expansion of children, and the earlier path that the low level begins with."""

import pytest
from support.arms_on_a_line import CROSSING, LATER, ArmsOnALine, OneConstraint, emitted, ended, endless, tree

from mmp_env.events import NodeCreated, NodeExpanded, Replanned
from mmp_planners.conflict_tree.constraints import EitherArm, EveryKind
from mmp_planners.conflict_tree.expansion import EagerExpansion, FromParent, FromScratch, LazyExpansion
from mmp_planners.planner import StopPlanning


def until_expanded(number):
    """Returns a watcher that stops after that many expanded nodes, and its events."""
    events = []

    def watch(event):
        events.append(event)
        if isinstance(event, NodeExpanded) and event.expanded_nodes == number:
            raise StopPlanning

    return events, watch


def names(events):
    return [type(event).__name__ for event in events if isinstance(event, (NodeCreated, NodeExpanded, Replanned))]


def test_eager_expansion_replans_both_children_before_the_next_selection():
    events, watch = until_expanded(2)
    assert not ended(tree(ArmsOnALine(endless, endless), expansion=EagerExpansion(), watch=watch))
    assert names(events)[4:] == ["Replanned", "NodeCreated"] * 2 + ["NodeExpanded"]


def test_a_lazy_child_keeps_the_paths_of_its_parent_until_it_is_selected():
    """Until then it has its parent's conflicts, so a replanned child with fewer conflicts is branched first."""
    context = ArmsOnALine([(0, 1, 1, 2), (0, 1, 3, 2)], [(2, 1, 1, 0)], [(9,)])
    events, watch = until_expanded(2)
    search = tree(context, w=9.0, expansion=LazyExpansion(), watch=watch)
    assert not ended(search)
    assert names(events) == ["Replanned"] * 3 + [
        "NodeCreated",
        "NodeExpanded",
        "Replanned",
        "NodeCreated",
        "NodeExpanded",
    ]
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0, 1]
    assert search.counts.generated_nodes == 2, "the other child was never planned"


@pytest.mark.parametrize("expansion", [EagerExpansion(), LazyExpansion()])
def test_both_expansions_find_the_same_solution_if_there_is_only_one(expansion):
    search, exhausted, _ = emitted(lambda watch: tree(ArmsOnALine(*CROSSING), expansion=expansion, watch=watch))
    assert not exhausted
    assert search.best.cost == 14.0
    search, exhausted, _ = emitted(
        lambda watch: tree(ArmsOnALine([(0, 1)], [(2, 1)]), expansion=expansion, watch=watch)
    )
    assert exhausted
    assert search.counts.dropped_children == 2


def test_a_lazy_child_without_a_path_is_dropped_when_it_is_selected():
    search, _, events = emitted(lambda watch: tree(ArmsOnALine(*LATER), expansion=LazyExpansion(), watch=watch, w=9.0))
    created = [event for event in events if isinstance(event, NodeCreated)]
    assert len(created) + search.counts.dropped_children == search.counts.generated_nodes
    assert [event.node for event in created] == sorted(event.node for event in created)


def test_branches_of_two_kinds_make_four_children():
    kinds = EveryKind(kinds=(EitherArm(kind=OneConstraint()), EitherArm(kind=OneConstraint())))
    events, watch = until_expanded(2)
    search = tree(ArmsOnALine(endless, endless), watch=watch)
    search.branching = kinds
    assert not ended(search)
    assert [event.arm for event in events if isinstance(event, NodeCreated)] == [None, "a", "b", "a", "b"]


def test_with_experience_the_low_level_gets_the_path_of_the_parent():
    context = ArmsOnALine([(0, 1, 2), (0, 5, 2)], [(2, 1, 0), (2, 7, 0)])
    tree(context, w=9.0, experience=FromParent()).run(0)
    given = [known if known is None else known[:, 0].tolist() for known in context.experiences]
    assert given == [None, None, [0, 1, 2], [2, 1, 0]]
    context = ArmsOnALine([(0, 1, 2), (0, 5, 2)], [(2, 1, 0), (2, 7, 0)])
    tree(context, w=9.0, experience=FromScratch()).run(0)
    assert context.experiences == [None] * 4
