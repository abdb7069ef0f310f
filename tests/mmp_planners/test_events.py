"""The events of a search, against the statistics of the run."""

import numpy as np
import pytest
from support import two_arms

from mmp_env import events
from mmp_planners import describe, make, names

COUNTED = {
    events.NodeExpanded: "expanded_nodes",
    events.Replanned: "low_level_calls",
    events.Repelled: "repulsions",
    events.FastTracked: "fast_track_tries",
}
TREE_PLANNERS = [name for name in names() if "restarts" in {option.name for option in describe(name).options}]
# Harder than `passing`: every planner expands nodes, and one of them restarts.
PROBLEM = two_arms.passing(1.0)


@pytest.fixture(scope="module", params=TREE_PLANNERS)
def run(request):
    """Returns the events of a run, and its result."""
    emitted = []
    result = make(request.param).plan(PROBLEM, seed=0, time_limit=60.0, watch=emitted.append)
    assert result.plan is not None
    return emitted, result


def of(emitted, kind):
    return [event for event in emitted if isinstance(event, kind)]


def test_the_events_agree_with_the_counts(run):
    emitted, result = run
    assert {kind.__name__: len(of(emitted, kind)) for kind in COUNTED} == {
        kind.__name__: result.stats[key] for kind, key in COUNTED.items()
    }
    assert len(of(emitted, events.SearchStarted)) == result.stats["restarts"] + 1
    assert sum(event.solved for event in of(emitted, events.FastTracked)) == result.stats["fast_track_hits"]
    created = of(emitted, events.NodeCreated)
    assert len(created) + result.stats["dropped_children"] == result.stats["generated_nodes"]
    assert created[0].conflicts == result.stats["root_conflicts"]
    assert result.stats["expanded_nodes"] == 0 or of(emitted, events.NodeExpanded)[-1].expanded_nodes == len(
        of(emitted, events.NodeExpanded)
    )


def test_times_and_node_numbers_ascend(run):
    emitted, _ = run
    times = [event.elapsed_s for event in emitted]
    assert times == sorted(times)
    numbers = [event.node for event in of(emitted, events.NodeCreated)]
    assert numbers == sorted(set(numbers))


def test_the_nodes_make_one_tree_for_each_search(run):
    """A child has an expanded parent of the same tree; a fast-tracked child has an open parent."""
    emitted, result = run
    tree, expanded, roots = {}, set(), 0
    for event in emitted:
        if isinstance(event, events.SearchStarted):
            tree, expanded = {}, set()
        elif isinstance(event, events.NodeExpanded):
            assert event.node in tree
            assert event.node not in expanded
            assert event.conflicts == tree[event.node].conflicts > 0
            expanded.add(event.node)
        elif isinstance(event, events.ConflictChosen):
            assert event.node in expanded
            assert event.arm_a < event.arm_b
            assert 0 <= event.start_s <= event.end_s
        elif isinstance(event, events.NodeCreated):
            roots += event.parent is None
            if event.parent is None:
                assert not tree
                assert (event.arm, event.constraint, event.fast_track) == (None, None, False)
            else:
                assert event.parent in (tree.keys() - expanded if event.fast_track else expanded)
                assert event.arm in PROBLEM.cell.arm_names or (event.arm is None and event.fast_track)
                assert (event.constraint is None) == event.fast_track
            tree[event.node] = event
    assert roots == result.stats["restarts"] + 1


def test_a_child_differs_from_its_parent_in_the_path_of_one_arm_or_of_those_of_a_fast_track(run):
    emitted, _ = run
    nodes = {event.node: event for event in of(emitted, events.NodeCreated)}
    for event in nodes.values():
        cost = sum(float(np.abs(np.diff(q, axis=0)).sum()) for q in event.paths.values())
        assert event.cost_rad == pytest.approx(cost)
        assert event.lower_bound_rad >= PROBLEM.cost_lower_bound_rad - 1e-9
        if event.parent is not None:
            parent = nodes[event.parent]
            changed = [arm for arm, q in event.paths.items() if q is not parent.paths[arm]]
            assert changed == [event.arm] or (event.arm is None and event.fast_track and len(changed) > 1)


def test_solutions_become_cheaper_and_the_last_one_is_returned(run):
    emitted, result = run
    found = of(emitted, events.SolutionFound)
    costs = [event.cost_rad for event in found]
    assert costs == sorted(set(costs), reverse=True)
    assert costs[-1] == pytest.approx(result.plan.cost_rad)
    assert found[-1].clearance_m == result.stats["min_clearance_m"]
    (node,) = (event for event in of(emitted, events.NodeCreated) if event.node == found[-1].node)
    for arm, q in node.paths.items():
        np.testing.assert_array_equal(result.plan.positions[arm][: len(q)], q)
        assert (result.plan.positions[arm][len(q) :] == q[-1]).all(), "an arm that is there first waits"


def test_replanning_takes_at_most_three_low_level_calls(run):
    emitted, _ = run
    before = None
    for event in of(emitted, events.Replanned):
        again = before is not None and not before.found
        assert event.tries == (before.tries % 3 + 1 if again else 1)
        assert not again or event.tries == 1 or (event.arm, event.constraints) == (before.arm, before.constraints)
        before = event


def test_the_iterates_of_repulsion_are_emitted_on_request_and_change_no_plan():
    plans, repelled = [], []
    for trace in (False, True):
        emitted = []
        plans.append(make("apf-ecbs-nf", trace=trace).plan(two_arms.passing(), seed=0, watch=emitted.append).plan)
        repelled.append(of(emitted, events.Repelled))
    for arm, q in plans[0].positions.items():
        np.testing.assert_array_equal(q, plans[1].positions[arm])
    assert [event.iterates for event in repelled[0]] == [()] * len(repelled[0])
    for event in repelled[1]:
        assert len(event.iterates) == event.iterations > 0
        assert all(q.shape == event.before.shape == event.after.shape for q in event.iterates)
        assert (event.after[[0, -1]] == event.before[[0, -1]]).all()
        assert any(np.allclose(q, event.after, rtol=0, atol=1e-6) for q in event.iterates)
