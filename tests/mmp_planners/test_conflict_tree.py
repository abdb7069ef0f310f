"""The conflict-tree search over arms on a line: what is branched, what becomes a solution, and when it ends."""

from itertools import pairwise

import pytest
from arms_on_a_line import ArmsOnALine, OneConstraint, Push, tree

from mmp_planners.conflict_tree import Counts
from mmp_planners.events import NodeCreated, NodeExpanded, SearchStarted
from mmp_planners.planner import StopPlanning

# Arms a and b go to each other's places and meet at place 1; a may go around by -5, at a cost of 12 instead of 2.
MEETING = ([(0, 1, 2), (0, -5, 2)], [(2, 1, 0)])


def endless(count):
    """A path for any number of constraints; two arms that have it are in conflict from its first step on."""
    return (0, 1)


def told(run, seed=0):
    """The run's return value and all that it told; `run` makes the tree from a watcher."""
    events = []
    search = run(events.append)
    return search, search.run(seed), events


def test_a_root_without_conflicts_is_the_solution():
    arms = ArmsOnALine([(0, 1)], [(5, 4)])
    search, exhausted, events = told(lambda watch: tree(arms, watch=watch))
    assert not exhausted
    assert (search.best.cost, search.best.clearance, search.best.bound_met) == (2.0, 0.01, True)
    assert search.counts == Counts(generated_nodes=1, low_level_calls=2, root_conflicts=0)
    assert [type(event).__name__ for event in events[:1] + events[-2:]] == [
        "SearchStarted",
        "NodeCreated",
        "SolutionFound",
    ]


def test_each_arm_of_the_first_conflict_gets_a_child_that_forbids_it_something():
    arms, kind = ArmsOnALine(endless, endless, [(9, 8)]), OneConstraint()
    events = []

    def until_expanded_twice(event):
        events.append(event)
        if isinstance(event, NodeExpanded) and event.expanded_nodes == 2:
            raise StopPlanning

    search = tree(arms, branching=kind, watch=until_expanded_twice)
    search.run(0)
    root, first, second = (event for event in events if isinstance(event, NodeCreated))
    assert (root.parent, root.arm, root.constraint) == (None, None, None)
    assert (first.parent, first.arm, first.constraint) == (root.node, "a", "a does something else")
    assert (second.parent, second.arm, second.constraint) == (root.node, "b", "b does something else")
    assert [(m.a, m.b, m.first, arm) for m, arm, _ in kind.asked] == [(0, 1, 0, 0), (0, 1, 0, 1)]
    assert [(arm, count) for arm, count, *_ in arms.calls] == [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1)]


def test_constraints_add_up_along_a_branch_and_leave_other_branches_alone():
    arms = ArmsOnALine([(0, 1), (3, 1), (3, 4)], [(0, 1), None])
    search, _, events = told(lambda watch: tree(arms, watch=watch, w=99.0))
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0, 1]
    assert [(arm, count) for arm, count, *_ in arms.calls if arm == 0] == [(0, 0), (0, 1), (0, 2)]
    assert {count for arm, count, *_ in arms.calls if arm == 1} == {0, 1}
    assert search.best.cost == 2.0


def test_an_arm_without_a_way_is_tried_three_times_with_a_growing_budget_and_then_dropped():
    arms = ArmsOnALine(*MEETING)
    search, _, _ = told(lambda watch: tree(arms, watch=watch))
    tries = [(count, budget) for arm, count, _, budget in arms.calls if arm == 1]
    assert tries == [(0, 1.0), (1, 1.0), (1, 2.0), (1, 4.0)]
    assert len({seed for *_, seed, _ in arms.calls}) == len(arms.calls)
    assert (search.counts.dropped_children, search.counts.low_level_calls) == (1, len(arms.calls))


def test_a_single_tree_that_runs_dry_is_exhausted():
    search, exhausted, events = told(lambda watch: tree(ArmsOnALine([(0, 1)], [(2, 1)]), watch=watch))
    assert exhausted
    assert search.best is None
    assert search.counts.dropped_children == 2
    assert sum(isinstance(event, SearchStarted) for event in events) == 1


def test_a_single_tree_without_a_root_is_exhausted():
    search, exhausted, _ = told(lambda watch: tree(ArmsOnALine([None], [(0, 1)]), watch=watch))
    assert exhausted
    assert search.counts == Counts(low_level_calls=3)


def trees(restarts, started):
    """Runs until that many trees have started or 80 nodes are expanded; expansions of each tree, and the parts."""
    arms, kind, expanded = ArmsOnALine(endless, endless), OneConstraint(), []

    def watch(event):
        if isinstance(event, SearchStarted):
            if event.restart == started:
                raise StopPlanning
            expanded.append(0)
        elif isinstance(event, NodeExpanded):
            expanded[-1] += 1
            if event.expanded_nodes == 80:
                raise StopPlanning

    search = tree(arms, branching=kind, restarts=restarts, watch=watch)
    assert not search.run(0)
    return expanded, arms, kind, search


def test_a_tree_that_does_not_get_on_is_given_up_for_another_with_more_patience():
    expanded, arms, kind, search = trees(restarts=True, started=3)
    assert expanded == [20, 24, 28]
    assert search.counts.restarts == 3
    assert len(set(arms.seeds)) == 3, "each tree has its own sub-seed"
    asked = [instant for _, _, instant in kind.asked]
    ends = [2 * sum(expanded[:k]) for k in range(4)]
    each = [set(asked[begin:end]) for begin, end in pairwise(ends)]
    assert each == [{"begin"}, {"middle"}, {"all"}]


def test_without_restarts_there_is_one_tree_however_long_it_takes():
    expanded, arms, _, search = trees(restarts=False, started=3)
    assert expanded == [80]
    assert (search.counts.restarts, len(arms.seeds)) == (0, 1)


def test_a_solution_within_w_times_the_bound_ends_the_search():
    search, exhausted, _ = told(lambda watch: tree(ArmsOnALine(*MEETING), w=4.0, watch=watch))
    assert not exhausted
    assert (search.best.cost, search.best.bound_met) == (14.0, True)


# As above, but b finds a cheap way as well, after its third constraint.
LATER = (
    lambda count: (0, 1, 2) if count == 0 else (0, -5, 2),
    lambda count: (2, 1, 0) if count < 3 else (2, 1.5, 0.5, 0),
)


def test_a_dearer_solution_is_waited_upon_for_as_many_expansions_as_patience_says():
    """The first expansion gives a solution that costs 14 where 4 is the bound, the third one that costs 4."""
    for patience, cost, expanded, met in ((1, 14.0, 2, False), (2, 4.0, 3, True), (20, 4.0, 3, True)):
        search, exhausted, _ = told(lambda watch, n=patience: tree(ArmsOnALine(*LATER), patience=n, watch=watch))
        assert not exhausted
        assert (search.best.cost, search.best.bound_met) == (cost, met)
        assert search.counts.expanded_nodes == expanded


def test_only_a_cheaper_solution_replaces_the_incumbent():
    arms = ArmsOnALine(*LATER, certificates=[(True, 0.5, (0, -1), 0.0), (True, 0.3, (0, -1), 0.0)])
    search, _, _ = told(lambda watch: tree(arms, watch=watch))
    assert (search.best.cost, search.best.clearance) == (4.0, 0.3)
    dearer_later = ([(0, 1, 2), (0, -1, 2)], [(2, 1, 0), (2, 1, 0), (2, 9, 0)])
    arms = ArmsOnALine(*dearer_later, certificates=[(True, 0.5, (0, -1), 0.0)])
    search, _, _ = told(lambda watch: tree(arms, watch=watch))
    assert (search.best.cost, search.best.clearance) == (6.0, 0.5)


def test_a_plan_that_cannot_be_proved_goes_on_as_a_node_with_that_conflict():
    """The first plan touches between the steps, where nobody looked; b has to give way there."""
    arms = ArmsOnALine([(0, 1, 2)], [(5, 4, 3), (5, 6, 3)], certificates=[(False, -0.1, (0, 1), 1.5)])
    kind = OneConstraint()
    search, _, events = told(lambda watch: tree(arms, w=2.0, branching=kind, watch=watch))
    assert [(m.a, m.b, m.first, m.last, arm) for m, arm, _ in kind.asked] == [(0, 1, 1.5, 1.5, k) for k in (0, 1)]
    assert search.counts.failed_certificates == 1
    assert (search.counts.expanded_nodes, search.counts.root_conflicts) == (1, 0)
    assert [event.node for event in events if type(event).__name__ == "SolutionFound"] == [2]
    assert search.best.cost == 6.0


def test_a_plan_in_which_one_arm_alone_touches_something_is_dropped():
    arms = ArmsOnALine(*MEETING, certificates=[(False, -0.1, (0, -1), 1.5)])
    search, exhausted, _ = told(lambda watch: tree(arms, watch=watch))
    assert exhausted
    assert search.best is None
    assert search.counts.failed_certificates == 1


def test_the_deadline_ends_the_search_with_the_best_so_far():
    arms = ArmsOnALine(*MEETING)

    def at_the_solution(event):
        if type(event).__name__ == "SolutionFound":
            arms.clock.cancel()

    search = tree(arms, watch=at_the_solution)
    assert not search.run(0), "a search that was cut short is not exhausted"
    assert search.best.cost == 14.0
    search = tree(arms)
    assert not search.run(0)
    assert (search.best, search.counts) == (None, Counts())


def test_a_watcher_ends_the_search_with_the_best_so_far():
    for name, cost in (("SolutionFound", 14.0), ("NodeExpanded", None)):
        events = []

        def watch(event, until=name, into=events):
            into.append(event)
            if type(event).__name__ == until:
                raise StopPlanning

        search = tree(ArmsOnALine(*MEETING), watch=watch)
        assert not search.run(0)
        assert (search.best and search.best.cost) == cost
        assert type(events[-1]).__name__ == name


def test_a_repelled_path_is_dearer_but_bounds_stay_those_of_the_planned_ones():
    arms = ArmsOnALine(*MEETING)
    search, _, events = told(lambda watch: tree(arms, w=99.0, modification=Push({0: (0, -6, 2)}), watch=watch))
    child = [event for event in events if isinstance(event, NodeCreated)][1]
    assert (child.cost_rad, child.lower_bound_rad) == (16.0, 14.0)
    assert search.best.plan.positions["a"][:, 0].tolist() == [0, -6, 2]
    assert search.counts.repulsions == 1


def test_the_root_is_not_repelled():
    search, _, _ = told(lambda watch: tree(ArmsOnALine([(0, 1)], [(5, 4)]), modification=Push({0: (0, 3, 1)})))
    assert search.best.cost == 2.0


@pytest.mark.parametrize("seed", [0, 1])
def test_what_a_node_is_planned_with_depends_on_the_seed_alone(seed):
    calls = []
    for _ in range(2):
        arms = ArmsOnALine(*LATER)
        tree(arms).run(seed)
        calls.append((arms.seeds, arms.calls))
    assert calls[0] == calls[1]
    other = ArmsOnALine(*LATER)
    tree(other).run(seed + 2)
    assert not {s for *_, s, _ in other.calls} & {s for *_, s, _ in calls[0][1]}
