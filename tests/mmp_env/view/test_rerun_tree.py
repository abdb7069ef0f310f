"""The conflict tree of a recording against the events of the planner."""

from dataclasses import replace

import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows

from mmp_env import events
from mmp_env.view.rerun import RerunWatcher
from mmp_env.view.rerun.search_record import SearchRecord
from mmp_env.view.rerun.tree_graph import MOST_ENTRIES, MOST_LABELS, growth, label, positions
from mmp_planners import make

PROBLEM = two_arms.passing(1.0)
IDS, EDGES, COLORS = "GraphNodes:node_ids", "GraphEdges:edges", "GraphNodes:colors"
LABELS, RADII = "GraphNodes:labels", "GraphNodes:radii"


class Both:
    """Passes events on to a recording, and keeps them."""

    wants_iterates = True

    def __init__(self, watcher):
        self.watcher, self.emitted = watcher, []

    def __call__(self, event):
        self.emitted.append(event)
        self.watcher(event)


@pytest.fixture(scope="module", params=["ecbs", "apf-ecbs", "gen-ecbs"])
def search(request, tmp_path_factory):
    """Returns the rows of a recording of a search, and the emitted events."""
    path = tmp_path_factory.mktemp("rerun") / "search.rrd"
    with RerunWatcher(PROBLEM, path) as watcher:
        both = Both(watcher)
        result = make(request.param).plan(PROBLEM, seed=0, watch=both)
        watcher.show_plan(result.plan)
    return Rows(path), both.emitted


def emitted_of(emitted, kind):
    return [event for event in emitted if isinstance(event, kind)]


def tree_at(rows, moment):
    """Returns ids and edges at a time of `expansion`."""
    ids = rows.at("/tree", IDS, "expansion")[moment]
    edges = rows.at("/tree", EDGES, "expansion").get(moment, [])
    return ids, {(edge["first"], edge["second"]) for edge in edges}


def test_nodes_and_edges_are_those_of_the_events(search):
    rows, emitted = search
    created, expanded = (emitted_of(emitted, kind) for kind in (events.NodeCreated, events.NodeExpanded))
    ids, edges = tree_at(rows, len(expanded) + 1)
    assert ids == [str(event.node) for event in created]
    assert edges == {(str(event.parent), str(event.node)) for event in created if event.parent is not None}
    assert rows.at("/tree", IDS, "plan time")[0.0] == ids


def test_the_tree_grows_with_the_expansions(search):
    rows, emitted = search
    moments = sorted(rows.at("/tree", IDS, "expansion"))
    count = len(emitted_of(emitted, events.NodeExpanded))
    assert moments == list(range(count + 2))
    there, expansion = {0: []}, 0
    for event in emitted:
        if isinstance(event, events.NodeExpanded):
            expansion += 1
            there[expansion] = list(there[expansion - 1])
        elif isinstance(event, events.NodeCreated):
            there[expansion].append(str(event.node))
    for moment, ids in there.items():
        found, edges = tree_at(rows, moment)
        assert found == ids
        assert {node for edge in edges for node in edge} <= set(ids)


def test_the_expanded_node_is_green_and_the_solution_blue_or_pink_of_the_fast_track(search):
    rows, emitted = search
    colors, expanded = rows.at("/tree", COLORS, "expansion"), emitted_of(emitted, events.NodeExpanded)
    for moment, event in enumerate(expanded, 1):
        ids, _ = tree_at(rows, moment)
        green = [name for name, color in zip(ids, colors[moment], strict=True) if color == 0x008A46FF]
        assert green == [str(event.node)]
    solution = emitted_of(emitted, events.SolutionFound)[-1].node
    (fast,) = (event.fast_track for event in emitted_of(emitted, events.NodeCreated) if event.node == solution)
    ids, _ = tree_at(rows, len(expanded) + 1)
    assert colors[len(expanded) + 1][ids.index(str(solution))] == (0xD23C96FF if fast else 0x1E78DCFF)


def test_labels_contain_the_constraint_as_text(search):
    rows, emitted = search
    labels = rows.at("/tree", LABELS, "plan time").get(0.0) or rows.statics(LABELS)["/tree"]
    for text, event in zip(labels, emitted_of(emitted, events.NodeCreated), strict=True):
        assert str(event.node) in text
        if event.constraint is not None:
            assert event.constraint in " ".join(text.split("\n"))


def test_an_arrow_marks_the_expanded_node_at_its_time_alone(tmp_path):
    with RerunWatcher(PROBLEM, tmp_path / "small.rrd") as watcher:
        for node in range(3):
            watcher(created(node, parent=node - 1 if node else None))
            watcher(events.NodeExpanded(elapsed_s=0.0, node=node, open_nodes=1, expanded_nodes=1, conflicts=1))
    labels = Rows(tmp_path / "small.rrd").at("/tree", LABELS, "expansion")
    marked = {moment: [k for k, text in enumerate(row) if text.startswith("▶")] for moment, row in labels.items()}
    assert marked == {0: [], 1: [0], 2: [1], 3: [2], 4: []}


def random_parents(rng, count, memory):
    return [None, *(int(rng.integers(max(0, k - memory), k)) for k in range(1, count))]


@pytest.mark.parametrize("count", [1, 2, 15, MOST_LABELS])
def test_no_two_labels_overlap(count):
    places = positions(random_parents(np.random.default_rng(count), count, 12), labelled=True)
    apart = np.abs(places[:, None] - places[None])
    apart[np.diag_indices(count)] = np.inf
    # Room for 30 letters and four lines.
    assert ((apart[..., 0] >= 185) | (apart[..., 1] >= 75)).all()


@pytest.mark.parametrize("memory", [1, 8, 60, 2000])
def test_circles_of_large_trees_do_not_overlap(memory):
    places = positions(random_parents(np.random.default_rng(3), 2000, memory), labelled=False)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    apart[np.diag_indices(len(places))] = np.inf
    largest = 13.0 * 1.45
    assert apart.min() >= 2 * largest


def test_large_trees_omit_some_moments_but_not_the_last_one():
    record = SearchRecord(problem=PROBLEM, most_nodes=1, most_repulsions=1)
    for number in range(0, 3002, 2):
        if number:
            record(events.NodeExpanded(elapsed_s=0.0, node=number - 1, open_nodes=1, expanded_nodes=1, conflicts=1))
        for node in (number, number + 1):
            record(created(node, parent=max(0, number - 1) if number else None))
    moments, counts = growth(record)
    assert sum(counts) <= 1.1 * MOST_ENTRIES
    assert (moments[0], moments[-1], counts[-1]) == (0, 1501, 3002)


def test_a_planner_that_restarts_its_node_numbers_has_all_of_them_shown(tmp_path):
    with RerunWatcher(PROBLEM, tmp_path / "again.rrd") as watcher:
        for restart in range(2):
            watcher(events.SearchStarted(elapsed_s=0.0, restart=restart, sub_seed=1))
            for node in range(2):
                watcher(created(node, parent=None if node == 0 else 0))
    ids, edges = tree_at(Rows(tmp_path / "again.rrd"), 1)
    assert len(set(ids)) == 4
    assert edges == {(ids[0], ids[1]), (ids[2], ids[3])}


def test_nodes_of_the_fast_track_have_a_mark_of_their_own_in_trees_without_words(tmp_path):
    with RerunWatcher(PROBLEM, tmp_path / "many.rrd") as watcher:
        for node in range(MOST_LABELS + 1):
            watcher(replace(created(node, parent=0 if node else None), conflicts=0, fast_track=node == 7))
    rows = Rows(tmp_path / "many.rrd")
    assert rows.static("/tree", "GraphNodes:show_labels") == [False]
    colors, radii = (rows.at("/tree", name, "expansion")[1] for name in (COLORS, RADII))
    assert (colors.count(colors[7]), radii.count(radii[7])) == (1, 1)
    assert radii[7] > radii[6]


def test_the_text_calls_the_clearance_of_a_solution_proved_by_the_planner(tmp_path):
    with RerunWatcher(PROBLEM, tmp_path / "solved.rrd") as watcher:
        watcher(created(0, parent=None))
        watcher(events.SolutionFound(elapsed_s=0.0, node=0, cost_rad=1.0, clearance_m=0.0016))
    words = Rows(tmp_path / "solved.rrd").at("/node/words", "TextDocument:text", "expansion")
    proof = "at least 1.6 mm at every instant by the planner's proof"
    assert [proof in text for (text,) in words.values()] == [False, True]


def test_no_text_of_a_planner_is_read_as_markdown(tmp_path):
    strange = "**left** <b>avoids</b>\n# [right](http://x.y)"
    with RerunWatcher(PROBLEM, tmp_path / "strange.rrd") as watcher:
        watcher(created(0, parent=None))
        watcher(replace(created(1, parent=0), constraint=strange))
        watcher(events.NodeExpanded(elapsed_s=0.0, node=1, open_nodes=0, expanded_nodes=1, conflicts=1))
    text = Rows(tmp_path / "strange.rrd").at("/node/words", "TextDocument:text", "expansion")[1][0]
    shown = r"\*\*left\*\* &lt;b&gt;avoids&lt;/b&gt; \# \[right\](http\://x.y)"
    assert f"- branch: **{shown}**\n" in text


def created(node, parent):
    paths = {arm: np.array([q, PROBLEM.goal[arm]]) for arm, q in PROBLEM.start.items()}
    return events.NodeCreated(
        elapsed_s=0.0,
        node=node,
        parent=parent,
        arm=None if parent is None else "left",
        constraint=None if parent is None else "left avoids right",
        paths=paths,
        cost_rad=1.0,
        lower_bound_rad=1.0,
        conflicts=1,
        conflicting_pairs=1,
    )


def test_after_a_restart_a_costlier_solution_of_the_same_number_does_not_replace_the_first():
    record, paths = SearchRecord(problem=PROBLEM, most_nodes=9, most_repulsions=1), []
    for restart, cost_rad in enumerate((1.0, 2.0)):
        record(events.SearchStarted(elapsed_s=0.0, restart=restart, sub_seed=1))
        record(root := replace(created(0, parent=None), cost_rad=cost_rad))
        record(events.SolutionFound(elapsed_s=0.0, node=0, cost_rad=cost_rad, clearance_m=0.01))
        paths.append(root.paths)
    assert record.tree.solution is record.tree.nodes[0]
    assert (record.solution.node, record.solution.created.paths) == (0, paths[0])


def test_fast_tracked_nodes_and_roots_say_so():
    from mmp_env.view.tree_record import TreeNode

    fast = TreeNode(id=3, number=7, parent=1, arm="left", conflicts=0, fast_track=True, on_solution_path=True)
    assert label(fast) == "★ 7: no conflict\nfast track\nleft is pushed aside"
    assert label(TreeNode(id=0, number=0, conflicts=1)) == "0: 1 conflict\nroot"
    assert label(TreeNode(id=2, number=2, restart=1)) == "2: unknown\nroot of tree 2"
