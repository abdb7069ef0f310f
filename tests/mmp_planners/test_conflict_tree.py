"""The conflict-tree search over arms on a line: branching, solutions, and the end of the search."""

import pytest
from support.arms_on_a_line import (
    CROSSING,
    LATER,
    ArmsOnALine,
    OneConstraint,
    Push,
    emitted,
    ended,
    endless,
    proof,
    refusal,
    tree,
)

from mmp_env.events import NodeCreated, NodeExpanded
from mmp_planners.conflict_tree.search import TreeCounts
from mmp_planners.planner import StopPlanning


def test_a_root_without_conflicts_is_the_solution():
    context = ArmsOnALine([(0, 1)], [(5, 4)])
    search, exhausted, events = emitted(lambda watch: tree(context, watch=watch))
    assert not exhausted
    assert (search.best.cost, search.best.clearance, search.best.bound_met) == (2.0, 0.01, True)
    assert search.counts == TreeCounts(generated_nodes=1, low_level_calls=2, root_conflicts=0)
    assert [type(event).__name__ for event in events[:1] + events[-2:]] == [
        "SearchStarted",
        "NodeCreated",
        "SolutionFound",
    ]


def test_each_arm_of_the_first_conflict_gets_a_child_that_forbids_it_something():
    context, kind = ArmsOnALine(endless, endless, [(9, 8)]), OneConstraint()
    events = []

    def until_expanded_twice(event):
        events.append(event)
        if isinstance(event, NodeExpanded) and event.expanded_nodes == 2:
            raise StopPlanning

    assert not ended(tree(context, branching=kind, watch=until_expanded_twice))
    root, first, second = (event for event in events if isinstance(event, NodeCreated))
    assert (root.parent, root.arm, root.constraint) == (None, None, None)
    assert (first.parent, first.arm, first.constraint) == (root.node, "a", "a does something else")
    assert (second.parent, second.arm, second.constraint) == (root.node, "b", "b does something else")
    assert [(m.a, m.b, m.first, arm) for m, arm, _ in kind.asked] == [(0, 1, 0, 0), (0, 1, 0, 1)]
    assert [(arm, count) for arm, count, *_ in context.calls] == [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1)]


def test_constraints_add_up_along_a_branch_and_leave_other_branches_alone():
    context = ArmsOnALine([(0, 1), (3, 1), (3, 4)], [(0, 1), None])
    search, _, events = emitted(lambda watch: tree(context, watch=watch, w=99.0))
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0, 1]
    assert [(arm, count) for arm, count, *_ in context.calls if arm == 0] == [(0, 0), (0, 1), (0, 2)]
    assert {count for arm, count, *_ in context.calls if arm == 1} == {0, 1}
    assert search.best.cost == 2.0


def test_an_arm_without_a_path_is_tried_three_times_with_a_growing_budget_and_then_dropped():
    context = ArmsOnALine(*CROSSING)
    search, _, _ = emitted(lambda watch: tree(context, watch=watch))
    tries = [(count, budget) for arm, count, _, budget in context.calls if arm == 1]
    assert tries == [(0, 1.0), (1, 1.0), (1, 2.0), (1, 4.0)]
    assert len({seed for *_, seed, _ in context.calls}) == len(context.calls)
    assert (search.counts.dropped_children, search.counts.low_level_calls) == (1, len(context.calls))


def test_only_a_cheaper_solution_replaces_the_incumbent():
    context = ArmsOnALine(*LATER, certificates=[proof(0.5), proof(0.3)])
    search, _, _ = emitted(lambda watch: tree(context, watch=watch))
    assert (search.best.cost, search.best.clearance) == (4.0, 0.3)
    dearer_later = ([(0, 1, 2), (0, -1, 2)], [(2, 1, 0), (2, 1, 0), (2, 9, 0)])
    context = ArmsOnALine(*dearer_later, certificates=[proof(0.5)])
    search, _, _ = emitted(lambda watch: tree(context, watch=watch))
    assert (search.best.cost, search.best.clearance) == (6.0, 0.5)


def test_a_plan_without_proof_returns_to_the_open_list_with_its_conflict():
    """The first plan has a contact between two steps, which the conflict test misses. Then b is replanned."""
    context = ArmsOnALine([(0, 1, 2)], [(5, 4, 3), (5, 6, 3)], certificates=[refusal(0, 1, instant=1.5)])
    kind = OneConstraint()
    search, _, events = emitted(lambda watch: tree(context, w=2.0, branching=kind, watch=watch))
    assert [(m.a, m.b, m.first, m.last, arm) for m, arm, _ in kind.asked] == [(0, 1, 1.5, 1.5, k) for k in (0, 1)]
    assert search.counts.failed_certificates == 1
    assert (search.counts.expanded_nodes, search.counts.root_conflicts) == (1, 0)
    assert [event.node for event in events if type(event).__name__ == "SolutionFound"] == [2]
    assert search.best.cost == 6.0


def test_a_plan_in_which_one_arm_alone_touches_something_is_dropped():
    context = ArmsOnALine(*CROSSING, certificates=[refusal(0, -1, instant=1.5)])
    search, exhausted, _ = emitted(lambda watch: tree(context, watch=watch))
    assert exhausted
    assert search.best is None
    assert search.counts.failed_certificates == 1


def test_a_repelled_path_is_dearer_but_bounds_stay_those_of_the_planned_ones():
    context = ArmsOnALine(*CROSSING)
    search, _, events = emitted(lambda watch: tree(context, w=99.0, modification=Push({0: (0, -6, 2)}), watch=watch))
    child = [event for event in events if isinstance(event, NodeCreated)][1]
    assert (child.cost_rad, child.lower_bound_rad) == (16.0, 14.0)
    assert search.best.plan.positions["a"][:, 0].tolist() == [0, -6, 2]
    assert search.counts.repulsions == 1


def test_the_root_is_not_repelled():
    search, _, _ = emitted(lambda watch: tree(ArmsOnALine([(0, 1)], [(5, 4)]), modification=Push({0: (0, 3, 1)})))
    assert search.best.cost == 2.0


@pytest.mark.parametrize("seed", [0, 1])
def test_the_seeds_of_a_node_depend_on_the_seed_of_the_run_alone(seed):
    calls = []
    for _ in range(2):
        context = ArmsOnALine(*LATER)
        tree(context).run(seed)
        calls.append((context.seeds, context.calls))
    assert calls[0] == calls[1]
    other = ArmsOnALine(*LATER)
    tree(other).run(seed + 2)
    assert not {s for *_, s, _ in other.calls} & {s for *_, s, _ in calls[0][1]}
