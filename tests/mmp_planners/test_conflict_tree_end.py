"""Ends of a conflict-tree search: bound met, patience, exhaustion, restart, deadline and watcher."""

from dataclasses import dataclass
from itertools import pairwise

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
    path,
    tree,
)

from mmp_env import core, draw_problem, find_cell
from mmp_env.events import NodeCreated, NodeExpanded, SearchStarted
from mmp_planners import make
from mmp_planners.conflict_tree.conflict_choice import EARLIEST, PAD_TREES, ConflictChoice
from mmp_planners.conflict_tree.fast_track import RepulsiveFastTrack
from mmp_planners.conflict_tree.search import TreeCounts
from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.planner import StopPlanning


def test_a_single_tree_without_open_nodes_is_exhausted():
    search, exhausted, events = emitted(lambda watch: tree(ArmsOnALine([(0, 1)], [(2, 1)]), watch=watch))
    assert exhausted
    assert search.best is None
    assert search.counts.dropped_children == 2
    assert sum(isinstance(event, SearchStarted) for event in events) == 1


def test_a_single_tree_without_a_root_is_exhausted():
    search, exhausted, _ = emitted(lambda watch: tree(ArmsOnALine([None], [(0, 1)]), watch=watch))
    assert exhausted
    assert search.counts == TreeCounts(low_level_calls=3)


def trees(started, arms=(endless, endless), budget=75, restarts=True, **parts):
    """Runs until `started` trees have begun or `budget` nodes are expanded.

    Returns the expansions per tree and the parts.
    """
    context, kind, expanded = ArmsOnALine(*arms), OneConstraint(), []

    def watch(event):
        if isinstance(event, SearchStarted):
            if event.restart == started:
                raise StopPlanning
            expanded.append(0)
        elif isinstance(event, NodeExpanded):
            expanded[-1] += 1
            if event.expanded_nodes == budget:
                raise StopPlanning

    search = tree(context, branching=kind, restarts=restarts, watch=watch, **parts)
    assert not ended(search)
    return expanded, context, kind, search


def test_a_restart_has_a_larger_budget_than_the_tree_before():
    expanded, context, kind, search = trees(restarts=True, started=3)
    assert expanded == [8, 9, 11]
    assert search.counts.restarts == 3
    assert len(set(context.seeds)) == 3, "each tree has its own sub-seed"
    asked = [instant for _, _, instant in kind.asked]
    ends = [2 * sum(expanded[:k]) for k in range(4)]
    each = [set(asked[begin:end]) for begin, end in pairwise(ends)]
    assert each == [{"begin"}, {"middle"}, {"all"}]


@pytest.mark.parametrize(
    ("parts", "pairs"),
    [
        ({}, [(0, 1), (3, 4), (0, 1), (3, 4), (0, 1)]),
        ({"choice": ConflictChoice(orders=EARLIEST)}, [(0, 1)] * 5),
        ({"restarts": False}, [(0, 1)]),
    ],
)
def test_every_second_tree_branches_on_an_isolated_pair_first(parts, pairs):
    later = (lambda count: (5, 8), lambda count: (6, 8))
    firsts = first_conflicts(5, arms=(endless, endless, endless, *later), **parts)
    assert [(first.a, first.b) for first in firsts] == pairs


def test_constraints_reach_further_in_each_tree_until_the_reach_begins_again():
    factors = [first.pad_factor for first in first_conflicts(PAD_TREES + 2)]
    assert all(before < after for before, after in pairwise(factors[:PAD_TREES]))
    assert factors[PAD_TREES:] == factors[:2]
    assert factors[:2] == [1.0, 1.4]
    assert {first.pad_factor for first in first_conflicts(4, choice=ConflictChoice(pad_growth=1.0))} == {1.0}
    assert {first.pad_factor for first in first_conflicts(4, restarts=False)} == {1.0}


def first_conflicts(started, arms=(endless, endless), **parts):
    """Returns the first conflict that each tree branches on."""
    expanded, _, kind, _ = trees(started=started, arms=arms, budget=250, **parts)
    return [kind.asked[2 * sum(expanded[:k])][0] for k in range(len(expanded))]


class PlannedClearOf(ArmsOnALine):
    """Records the paths that each arm is planned clear of; then arm a has the path `around`, and b has none."""

    around = path(0, 3, 1)

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.others = []

    def low_level(self, arm, constraints, seed, budget=1.0, others=(), experience=None):
        self.others.append((arm, tuple(others)))
        if others:
            return (self.around if arm == 0 else None), 1
        return super().low_level(arm, constraints, seed, budget, others, experience)


def test_after_a_restart_arms_in_conflict_begin_clear_of_the_settled_arms_and_keep_their_bounds():
    context, roots = PlannedClearOf(endless, endless, lambda count: (5, 6)), []

    def watch(event):
        if isinstance(event, NodeCreated) and event.parent is None:
            roots.append(event)
            context.others.append("root")
            if len(roots) == 2:
                raise StopPlanning

    search = tree(context, branching=OneConstraint(), restarts=True, watch=watch)
    assert not ended(search)
    first, again = context.others[:3], context.others[context.others.index("root") + 1 :]
    assert first == [(0, ()), (1, ()), (2, ())]
    settled = again[-4][1][0]
    assert again[-4:] == [(0, (settled,)), (1, (settled,)), (1, ()), "root"]
    assert settled.q[:, 0].tolist() == [5, 6]
    assert [root.cost_rad for root in roots] == [3, 7]
    assert [root.lower_bound_rad for root in roots] == [3, 3]


def test_without_restarts_there_is_one_tree_however_long_it_takes():
    expanded, context, _, search = trees(restarts=False, started=3)
    assert expanded == [75]
    assert (search.counts.restarts, len(context.seeds)) == (0, 1)


def test_the_bound_is_the_least_of_the_open_nodes_also_when_it_falls():
    seen = []

    @dataclass(frozen=True, kw_only=True)
    class Seen(Focal):
        def __call__(self, open_nodes, lower_bound):
            seen.append((lower_bound, min(n.lower_bound for n in open_nodes), max(n.lower_bound for n in open_nodes)))
            if len(seen) == 20:
                raise StopPlanning
            return super().__call__(open_nodes, lower_bound)

    # Paths are sampled, so a path with one more constraint may be shorter.
    context = ArmsOnALine(lambda count: (0, 1 + 7 * count % 5), lambda count: (0, 3 + 3 * count % 7))
    assert not ended(tree(context, selection=Seen(w=1.5)))
    bounds, least, most = zip(*seen, strict=True)
    assert bounds == least
    assert list(least) != sorted(least)
    assert any(high > bound for bound, high in zip(bounds, most, strict=True))


def test_the_bound_counts_the_solution_itself():
    """The root, of bound 4, gets a solution of cost 9 and is then branched. The bound of what is left is 20."""
    places = ([(0, 1, 2), None], [(2, 1, 0), (2, 1, 9, 0)])
    fast_track = RepulsiveFastTrack(modification=Push({0: (0, -2.5, 2)}))
    search = tree(ArmsOnALine(*places), w=1.5, fast_track=fast_track)
    search.run(0)
    assert (search.best.cost, search.best.bound_met) == (9.0, False)


def test_the_bound_counts_a_solution_that_is_no_better_than_another():
    """Child of a: cost 14, bound 14. Child of b: cost 16, bound 5, because it was repelled. OPEN is empty then."""
    places = ([(0, 1, 2), (0, 7, 2)], [(2, 1, 0), (2, 3.5, 0)])
    push = Push({1: (2, 9, 0)})
    search = tree(ArmsOnALine(*places), w=1.3, modification=push)
    search.run(0)
    assert search.best.cost == 14.0
    assert not search.best.bound_met, "9 is less than 14 / 1.3"


@pytest.mark.parametrize(("straight", "met"), [(4.0, True), (3.0, False)])
def test_with_the_straight_lines_as_bound_w_holds_absolutely(straight, met):
    search, _, _ = emitted(lambda watch: tree(ArmsOnALine(*CROSSING), w=4.0, watch=watch, absolute_bound=straight))
    assert (search.best.cost, search.best.bound_met) == (14.0, met)


def test_the_option_bound_chooses_the_straight_lines():
    """Instance whose paths have no conflict, but one of them is longer than its straight line."""
    problem = draw_problem(find_cell("ring-2"), seed=11)
    for bound, met in (("paths", True), ("straight", False)):
        result = make("ecbs", bound=bound, w=1.005, patience=1).plan(problem, seed=11, time_limit=60.0)
        assert result.plan.cost_rad > 1.005 * problem.cost_lower_bound_rad
        assert result.stats["bound_met"] is met


def test_a_solution_within_w_times_the_bound_ends_the_search():
    search, exhausted, _ = emitted(lambda watch: tree(ArmsOnALine(*CROSSING), w=4.0, watch=watch))
    assert not exhausted
    assert (search.best.cost, search.best.bound_met) == (14.0, True)


def test_the_search_goes_on_for_patience_expansions_after_a_costly_solution():
    """The bound is 4. The first expansion gives a solution of cost 14, the third one of cost 4."""
    for patience, cost, expanded, met in ((1, 14.0, 2, False), (2, 4.0, 3, True), (20, 4.0, 3, True)):
        search, exhausted, _ = emitted(lambda watch, n=patience: tree(ArmsOnALine(*LATER), patience=n, watch=watch))
        assert not exhausted
        assert (search.best.cost, search.best.bound_met) == (cost, met)
        assert search.counts.expanded_nodes == expanded


def test_the_deadline_ends_the_search_with_the_best_so_far():
    context = ArmsOnALine(*CROSSING)

    def at_the_solution(event):
        if type(event).__name__ == "SolutionFound":
            context.clock.cancel()

    search = tree(context, watch=at_the_solution)
    assert not search.run(0), "a search that was cut short is not exhausted"
    assert search.best.cost == 14.0
    search = tree(context)
    assert not search.run(0)
    assert (search.best, search.counts) == (None, TreeCounts())


def test_a_watcher_ends_the_search_with_the_best_so_far():
    for name, cost in (("SolutionFound", 14.0), ("NodeExpanded", None)):
        events = []

        def watch(event, until=name, into=events):
            into.append(event)
            if type(event).__name__ == until:
                raise StopPlanning

        search = tree(ArmsOnALine(*CROSSING), watch=watch)
        with pytest.raises(StopPlanning):
            search.run(0)
        assert (search.best and search.best.cost) == cost
        assert type(events[-1]).__name__ == name


class TimeUpAfterOneArm(ArmsOnALine):
    """Time is up as soon as an arm is planned."""

    def low_level(self, arm, constraints, seed, budget=1.0, others=(), experience=None):
        self.clock = core.Clock(0.0)
        return super().low_level(arm, constraints, seed, budget, others, experience)


def test_a_root_ends_between_two_arms_when_time_is_up():
    context = TimeUpAfterOneArm(*CROSSING)
    search = tree(context)
    search.run(0)
    assert [arm for arm, *_ in context.calls] == [0]
    assert not search.exhausted
    assert search.best is None


def test_time_to_release_the_open_nodes_is_reserved(monkeypatch):
    monkeypatch.setattr("mmp_planners.conflict_tree.search.NODE_RELEASE_S", 100.0)
    context = ArmsOnALine(endless, endless)
    context.clock = core.Clock(1000.0)
    search = tree(context, branching=OneConstraint(), restarts=False)
    assert not ended(search)
    assert not search.exhausted
    assert 5 <= search.counts.expanded_nodes <= 15
    assert context.clock.expired
