import math

import numpy as np
import pytest
from support import grown_trees, stand_in_planners, two_arms
from support.grown_trees import branched, created, expanded, fast_tracked, solved, started

from mmp_env import events
from mmp_env.errors import MmpError
from mmp_env.view.search_tree import SearchTree
from mmp_planners import make

PROBLEM = two_arms.passing(1.0)


@pytest.fixture(scope="module", params=["cbs", "ecbs", "apf-ecbs", "gen-ecbs"])
def run(request):
    """Returns the events of a planner, the recorded tree, and the result."""
    emitted, tree = [], SearchTree(PROBLEM, keep_paths=True)

    def watch(event):
        emitted.append(event)
        tree(event)

    result = make(request.param).plan(PROBLEM, seed=0, time_limit=60.0, watch=watch)
    assert result.plan is not None
    return emitted, tree, result, request.param


def of(emitted, kind):
    return [event for event in emitted if isinstance(event, kind)]


def test_nodes_and_edges_are_those_of_the_events(run):
    emitted, tree, result, _ = run
    nodes = of(emitted, events.NodeCreated)
    assert len(nodes) == result.stats["generated_nodes"] or len(nodes) > 1
    assert [node.number for node in tree.nodes] == [event.node for event in nodes]
    numbers = [None if node.parent is None else tree.nodes[node.parent].number for node in tree.nodes]
    assert numbers == [event.parent for event in nodes]
    fields = ("arm", "constraint", "cost_rad", "lower_bound_rad", "conflicts", "conflicting_pairs", "fast_track")
    for node, event in zip(tree.nodes, nodes, strict=True):
        assert [getattr(node, field) for field in fields] == [getattr(event, field) for field in fields]
        assert all(node.paths[arm] is event.paths[arm] for arm in event.paths)
    assert [node.id for node in tree.nodes] == list(range(len(nodes)))


def test_expansions_are_those_of_the_events(run):
    emitted, tree, result, _ = run
    assert [tree.nodes[k].number for k in tree.expansions] == [event.node for event in of(emitted, events.NodeExpanded)]
    assert len(tree.expansions) == result.stats["expanded_nodes"]
    order = sorted((node.expanded, node.id) for node in tree.nodes if node.expanded)
    assert [node for _, node in order] == tree.expansions
    assert all(tree.nodes[k].conflict for k in tree.expansions)


def test_every_tree_begins_with_a_root_of_its_restart(run):
    emitted, tree, _, _ = run
    assert len(tree.roots) == sum(event.parent is None for event in of(emitted, events.NodeCreated))
    assert [root.restart for root in tree.roots] == list(range(len(tree.roots)))
    for node in tree.nodes:
        if node.parent is not None:
            assert node.restart == tree.nodes[node.parent].restart


def test_the_solution_path_leads_from_a_root_to_the_plan(run):
    _, tree, result, _ = run
    path = tree.solution_path
    assert path[0].parent is None
    assert [node.parent for node in path[1:]] == [node.id for node in path[:-1]]
    assert path[-1].conflicts == 0
    assert path[-1].cost_rad == pytest.approx(result.plan.cost_rad)
    assert [node for node in tree.nodes if node.on_solution_path] == path


def test_watching_changes_no_plan(run):
    *_, result, name = run
    alone = make(name).plan(PROBLEM, seed=0, time_limit=60.0)
    assert alone.plan.times.tolist() == result.plan.times.tolist()
    for arm, q in alone.plan.positions.items():
        assert np.array_equal(q, result.plan.positions[arm])
    assert dict(alone.plan.stats) == dict(result.plan.stats)


@pytest.mark.parametrize("name", ["rrt-connect", "prioritized", "auto"])
def test_a_planner_without_a_tree_has_the_nodes_of_its_plans(name):
    tree = SearchTree(PROBLEM)
    result = make(name).plan(PROBLEM, seed=0, time_limit=60.0, watch=tree)
    assert len(tree.nodes) >= 1
    assert tree.solution_path == tree.nodes  # each better than the one before
    assert tree.solution.cost_rad == pytest.approx(result.plan.cost_rad)


def test_a_number_that_is_reused_after_a_restart_is_another_node():
    tree = SearchTree()
    for restart in range(2):
        for event in (started(restart), created(0), created(1, 0), created(2, 1), expanded(0)):
            tree(event)
    tree(solved(2, 12.0))
    assert [node.number for node in tree.nodes] == [0, 1, 2, 0, 1, 2]
    assert tree.parents == [None, 0, 1, None, 3, 4]
    assert [node.restart for node in tree.nodes] == [0, 0, 0, 1, 1, 1]
    assert tree.expansions == [0, 3]
    assert [node.id for node in tree.solution_path] == [3, 4, 5]


def test_a_node_that_has_its_parents_number_hangs_from_the_older_one():
    tree = SearchTree()
    for event in (created(0), created(0, 0)):
        tree(event)
    assert tree.parents == [None, 0]


def test_the_cheapest_of_several_solutions_is_shown():
    tree = grown_trees.grown([None, 0, 0])
    for event in (solved(2, 12.0), solved(1, 11.0)):
        tree(event)
    assert tree.solution.number == 1
    assert [node.number for node in tree.nodes if node.on_solution_path] == [0, 1]
    tree(solved(2, 12.0))
    assert tree.solution.number == 1


def test_events_may_name_nodes_whose_creation_was_not_reported():
    tree = SearchTree(PROBLEM)
    stand_in_planners.Straight().plan(PROBLEM, watch=tree)
    (node,) = tree.nodes
    assert (node.expanded, node.conflicts, node.on_solution_path) == (1, 0, True)
    assert node.cost_rad > 0
    assert math.isnan(node.lower_bound_rad)
    tree(created(7, 5))
    assert tree.nodes[1].parent is None


def test_the_plan_of_a_silent_planner_is_a_node():
    tree = SearchTree(PROBLEM)
    plan = stand_in_planners.straight_plan(PROBLEM, {})
    tree.add_plan(plan)
    (node,) = tree.nodes
    assert (node.cost_rad, node.conflicts, tree.solution) == (plan.cost_rad, 0, node)
    tree.add_plan(plan)
    assert len(tree.nodes) == 1


def test_a_plan_cheaper_than_every_reported_node_is_a_child_of_the_solution():
    plan = stand_in_planners.straight_plan(PROBLEM, {})
    tree = SearchTree(PROBLEM)
    for event in (created(0), created(1, 0, conflicts=0, cost_rad=plan.cost_rad + 1), solved(1, plan.cost_rad + 1)):
        tree(event)
    before = tree.solution
    tree.add_plan(plan)
    assert (tree.solution.cost_rad, tree.solution.parent, len(tree.nodes)) == (plan.cost_rad, before.id, 3)
    assert tree.solution_path[-2:] == [before, tree.solution]
    assert "made shorter" in tree.svg()


def test_a_shortened_plan_is_a_child_of_the_plan_as_found():
    tree = SearchTree(PROBLEM)
    plan = make("ecbs", shorten=100).plan(PROBLEM, seed=0, time_limit=60.0, watch=tree).plan
    tree.add_plan(plan)
    *_, found, shorter = tree.solution_path
    assert (found.conflicts, shorter.conflicts) == (0, 0)
    assert plan.cost_rad == shorter.cost_rad < found.cost_rad
    assert "made shorter" in tree.svg()


def test_conflicts_and_fast_track_attempts_are_recorded_as_text():
    tree = grown_trees.grown([None, 0])
    for event in (branched(0), fast_tracked(1, solved=False)):
        tree(event)
    assert tree.nodes[0].conflict == "left and right meet at 2.0 to 2.5 s"
    assert tree.nodes[1].fast_tracks == [("left", False)]


def test_paths_are_kept_only_when_asked_for():
    paths = {"left": np.zeros((2, 6))}
    for keep in (False, True):
        tree = SearchTree(keep_paths=keep)
        tree(created(0, paths=paths))
        assert (tree.nodes[0].paths == paths) is keep


def test_a_tree_displays_itself_in_a_notebook_and_can_be_saved(tmp_path):
    tree = grown_trees.grown([None, 0, 0], solution=2)
    tree.save(tmp_path / "tree.svg")
    text = (tmp_path / "tree.svg").read_text(encoding="utf-8")
    assert text == tree._repr_svg_() == tree.svg()
    with pytest.raises(MmpError, match="No such file"):
        tree.save(tmp_path / "none" / "tree.svg")
