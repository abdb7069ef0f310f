"""The fast track: if one arm is in every conflict, repulsion moves this arm alone."""

import pytest
from support.arms_on_a_line import ArmsOnALine, Push, node, path, refusal, tree

from mmp_env.events import FastTracked, NodeCreated, NodeExpanded, SolutionFound
from mmp_planners.conflict_tree.constraints import Branch
from mmp_planners.conflict_tree.fast_track import (
    NoFastTrack,
    RepulsionOfSeveralArms,
    RepulsiveFastTrack,
    vertex_cover,
)

TWO, THREE = ArmsOnALine((), ()), ArmsOnALine((), (), ())
SWAP = [(0, 1, 2), (2, 1, 0)]


def tries(fast_track, n):
    context = {2: TWO, 3: THREE}[len(n.paths)]
    return [(attempt.arms, attempt.solved) for attempt in fast_track(context, n)]


def test_a_single_pair_is_tried_with_the_lower_arm_first():
    push = Push({0: (0, 1, 3, 2), 1: (2, 5, 0)})
    assert tries(RepulsiveFastTrack(modification=push), node(0, *SWAP)) == [((0,), False), ((1,), True)]
    assert tries(RepulsiveFastTrack(modification=Push({1: (2, 5, 0)})), node(0, *SWAP)) == [((1,), True)]


def test_the_arm_in_every_pair_is_tried_and_no_other():
    push = Push(dict.fromkeys(range(3), (7, 8, 9)))
    n = node(0, (0, 1, 2), (2, 1, 4), (2, 6, 7))
    assert set(n.conflicts) == {(0, 1), (1, 2)}
    assert tries(RepulsiveFastTrack(modification=push), n) == [((1,), True)]


def test_without_an_arm_in_every_pair_nothing_is_tried():
    push = Push(dict.fromkeys(range(3), (7, 8, 9)))
    n = node(0, (1, 1), (1, 1), (1, 1))
    assert tries(RepulsiveFastTrack(modification=push), n) == []
    assert tries(NoFastTrack(), node(0, *SWAP)) == []


@pytest.mark.parametrize("literal", [False, True])
def test_a_try_leaves_the_node_as_it_is(literal):
    n = node(0, *SWAP)
    before = n.paths, n.conflicts
    (attempt,) = RepulsiveFastTrack(modification=Push({0: (0, -5, 2)}), literal=literal)(TWO, n)
    assert (n.paths, n.conflicts) == before
    assert attempt.replaces == literal
    assert (attempt.node.cost, attempt.node.lower_bound, attempt.node.conflicts) == (14.0, 4.0, {})


def searched(push, places, *, literal=False, w=1.0, **parts):
    events = []
    context = ArmsOnALine(*places, **{key: parts.pop(key) for key in ("certificates",) if key in parts})
    fast_track = RepulsiveFastTrack(modification=Push(push), literal=literal)
    search = tree(context, w=w, watch=events.append, fast_track=fast_track, **parts)
    return search, search.run(0), events


# Both meet at place 1. With a constraint, b has a detour that costs 5 more than its straight path.
PLACES = ([(0, 1, 2)], [(2, 1, 0), (2, 4.5, 0)])


@pytest.mark.parametrize("literal", [False, True])
def test_a_hit_within_w_times_the_bound_is_the_solution_without_any_expansion(literal):
    search, exhausted, events = searched({0: (0, -1, 2)}, PLACES, literal=literal, w=1.5)
    assert not exhausted
    assert (search.best.cost, search.best.bound_met) == (6.0, True)
    counts = search.counts
    assert (counts.expanded_nodes, counts.fast_track_tries, counts.fast_track_hits) == (0, 1, 1)
    root, hit = (event for event in events if isinstance(event, NodeCreated))
    assert (hit.fast_track, hit.parent, hit.arm, hit.constraint, hit.conflicts) == (True, root.node, "a", None, 0)
    assert not root.fast_track
    assert [(event.node, event.arms, event.solved) for event in events if isinstance(event, FastTracked)] == [
        (root.node, ("a",), True)
    ]


def test_after_a_sound_hit_that_costs_too_much_the_node_is_branched():
    search, _, events = searched({0: (0, -9, 2)}, PLACES)
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0]
    assert (search.counts.fast_track_tries, search.counts.fast_track_hits) == (1, 1)
    assert search.best.cost == 9.0, "the child of b is cheaper than the hit"


def test_after_a_literal_hit_the_solution_takes_the_place_of_the_node_and_is_selected_like_any_other():
    """Algorithm 1: N takes the modified paths, stays in OPEN and is evaluated again."""
    search, exhausted, events = searched({0: (0, -9, 2)}, PLACES, literal=True)
    assert not exhausted
    assert not [event for event in events if isinstance(event, NodeExpanded)]
    assert search.best.cost == 22.0


class PushBesideDetour(Push):
    """Moves an arm only if arm a has its detour by place 3."""

    def __call__(self, context, paths, arm, constraints):
        return super().__call__(context, paths, arm, constraints) if 3 in paths[0].q else None


@pytest.mark.parametrize(("literal", "solutions"), [(False, [90.0, 12.0]), (True, [14.0])])
def test_a_literal_hit_that_costs_too_much_is_no_solution_while_cheaper_nodes_are_open(literal, solutions):
    """No arm is in both conflicts of the root. Where a has its detour, c can be moved, at a high cost.

    With the literal fast track the cheaper solutions below that node are lost.
    """
    places = ([(0, 1, 2), (0, 3, 2)], [(2, 1, 0), (2, 4, 0)], [(10, 11, 12), (10, 13, 12)], [(12, 11, 10)])
    fast_track = RepulsiveFastTrack(modification=PushBesideDetour({2: (10, -30, 12)}), literal=literal)
    events = []
    search = tree(ArmsOnALine(*places), w=1.9, watch=events.append, fast_track=fast_track, patience=10**6)
    search.run(0)
    assert [event.cost_rad for event in events if isinstance(event, SolutionFound)] == solutions
    assert search.counts.fast_track_hits == 1


@pytest.mark.parametrize("literal", [False, True])
def test_a_miss_leaves_the_node_to_be_branched_with_its_own_paths(literal):
    """Both arms are tried. The modified paths are discarded, though they leave fewer conflicts."""
    push = {0: (0, 0.5, 1, 0, 2), 1: (2, 1, 0, 0)}
    places = ([(0, 1, 2, 2), (0, 3, 2)], [(2, 1, 0, 0), None])
    search, _, events = searched(push, places, literal=literal, w=9.0)
    assert [(event.node, event.arms, event.solved) for event in events if isinstance(event, FastTracked)] == [
        (0, ("a",), False),
        (0, ("b",), False),
    ]
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0]
    assert search.best.cost == 6.0


@pytest.mark.parametrize("literal", [False, True])
def test_a_hit_without_proof_returns_to_the_open_list_with_its_conflict(literal):
    refused = refusal(0, 1, instant=0.5)
    search, _, _ = searched({0: (0, -1, 2)}, PLACES, literal=literal, w=9.0, certificates=[refused])
    assert search.counts.failed_certificates == 1
    assert search.best is not None
    assert search.counts.expanded_nodes == 1


def test_a_miss_is_discarded_and_each_node_is_tried_once():
    """Pushing a never helps. b takes a detour after its second constraint."""
    places = ([(0, 1, 2), None], [(2, 1, 0), (2, 1, 0), (2, 4.5, 0)])
    search, _, events = searched({0: (0, 1, 3, 2)}, places, w=9.0)
    assert search.counts.fast_track_hits == 0
    assert [event.node for event in events if isinstance(event, FastTracked)] == [0, 2]
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0, 2]
    assert search.best.cost == 9.0


@pytest.mark.parametrize(("children", "tried"), [(True, [1, 3]), (False, [1])])
def test_the_fast_track_is_tried_on_each_child_or_before_a_node_is_branched(children, tried):
    """No arm is in both conflicts of the root. In each child, c can be pushed aside."""
    places = ([(0, 1, 2), (0, 3, 2)], [(2, 1, 0), (2, 4, 0)], [(10, 11, 12)], [(12, 11, 10)])
    events = []
    fast_track = RepulsiveFastTrack(modification=Push({2: (10, -11, 12)}), on_children=children)
    search = tree(ArmsOnALine(*places), w=99.0, watch=events.append, fast_track=fast_track)
    search.run(0)
    assert [event.node for event in events if isinstance(event, FastTracked)] == tried
    assert [event.node for event in events if isinstance(event, NodeExpanded)] == [0]
    assert search.best is not None


@pytest.mark.parametrize("cover", [False, True])
def test_several_arms_are_repelled_each_from_the_new_paths_of_those_before(cover):
    """No arm is in both pairs. Of each pair one arm moves, and then the other has no conflict left."""
    n = node(0, (0, 1, 2), (2, 1, 0), (10, 11, 12), (12, 11, 10))
    push = Push({0: (0, -1, 2), 2: (10, -11, 12)})
    fast_track = RepulsionOfSeveralArms(modification=push, cover=cover)
    (attempt,) = fast_track(ArmsOnALine((), (), (), ()), n)
    assert (attempt.arms, attempt.solved, attempt.replaces) == ((0, 2), True, False)
    assert attempt.node.bounds == n.bounds
    assert attempt.node.cost == 4 + 2 + 44 + 2


@pytest.mark.parametrize("keep_misses", [False, True])
def test_a_miss_with_fewer_conflicts_replaces_the_node_if_misses_are_kept(keep_misses):
    n = node(0, (0, 1, 2), (2, 1, 0), (10, 11, 12), (12, 11, 10))
    fast_track = RepulsionOfSeveralArms(modification=Push({0: (0, -1, 2)}), keep_misses=keep_misses)
    (attempt,) = fast_track(ArmsOnALine((), (), (), ()), n)
    assert (attempt.arms, attempt.solved, attempt.replaces) == ((0,), False, keep_misses)
    assert list(attempt.node.conflicts) == [(2, 3)]


@pytest.mark.parametrize(("passing", "arms"), [((0, 1, 2, 3), (1, 2)), ((0, 1, 2, 2, 3), (2,))])
def test_the_last_resort_is_kept_only_if_it_leaves_no_conflict(passing, arms):
    """Arm b has arrived when a passes. The modification moves only arm c, so that c and d have no conflict."""
    n = node(0, passing, (5, 2), (10, 11, 12, 13), (15, 12))
    fast_track = RepulsionOfSeveralArms(modification=Push({2: (10, 11, 14, 13)}), last_resort=Push({1: (5, 2, 7, 2)}))
    (attempt,) = fast_track(ArmsOnALine((), (), (), ()), n)
    assert (attempt.arms, attempt.solved) == (arms, 1 in arms)
    assert (attempt.node.paths[1] is n.paths[1]) == (1 not in arms)


def test_an_arm_that_the_last_resort_moved_in_vain_is_left_alone_until_a_path_near_it_has_changed():
    moved = []

    def resort(context, paths, arm, constraints):
        moved.append(arm)

    n = node(0, (0, 1, 2, 3), (5, 2))
    fast_track = RepulsionOfSeveralArms(modification=Push({}), last_resort=resort, cover=True)
    assert list(fast_track(TWO, n)) == []
    assert moved == [0]
    assert list(fast_track(TWO, n)) == []
    assert moved == [0]


def test_the_last_resort_is_not_tried_while_arms_meet_that_both_move():
    push = Push({0: (0, 1, 3, 2), 1: (2, 5, 0)})
    assert tries(RepulsionOfSeveralArms(modification=Push({}), last_resort=push), node(0, *SWAP)) == []


def test_a_modification_that_leaves_as_many_conflicts_is_no_attempt():
    fast_track = RepulsionOfSeveralArms(modification=Push({0: (0, 1, 3, 2), 1: (2, 1, 0)}))
    assert list(fast_track(TWO, node(0, *SWAP))) == []


@pytest.mark.parametrize(
    ("arm", "to", "again"), [(0, (0, 1, 1.5, 2), [0]), (1, (2, 1, 1, 0), [0]), (2, (60, 61), []), (2, (9, 2.05), [0])]
)
def test_an_arm_moved_in_vain_is_tried_again_when_a_path_near_it_has_changed(arm, to, again):
    """Arms a and b swap places; c is far away, at first or at last."""
    moved = []

    def push(context, paths, arm, constraints):
        moved.append(arm)

    n = node(0, *SWAP, (50, 51))
    fast_track = RepulsionOfSeveralArms(modification=push, cover=True)
    assert list(fast_track(THREE, n)) == []
    assert moved == [0]
    child = n.child(Branch(arm=arm, constraints=(), kind=0, description=""))
    paths, found = child.replaced(THREE, arm, path(*to))
    child.update(paths=paths, conflicts=found)
    assert list(fast_track(THREE, child)) == []
    assert moved[1:] == again


@pytest.mark.parametrize("keep_misses", [False, True])
def test_a_kept_miss_is_branched_with_its_new_paths_and_a_discarded_one_with_its_own(keep_misses):
    """Arm a can be pushed aside; c and d need a branch."""
    places = ([(0, 1, 2), (0, 3, 2)], [(2, 1, 0)], [(10, 11, 12)], [(12, 11, 10), (12, 13, 10)])
    push = Push({0: (0, -1, 2)})
    fast_track = RepulsionOfSeveralArms(modification=push, keep_misses=keep_misses)
    events = []
    search = tree(ArmsOnALine(*places), w=9.0, watch=events.append, fast_track=fast_track)
    search.run(0)
    first = next(event for event in events if isinstance(event, NodeExpanded))
    assert first.conflicts == (1 if keep_misses else 2)
    assert search.best is not None


def test_a_vertex_cover_has_an_arm_of_every_pair_and_no_smaller_one_exists():
    assert vertex_cover([(0, 1), (0, 2), (3, 4)]) == [0, 3]
    assert vertex_cover([]) == []
    star = [(5, other) for other in range(20) if other != 5]
    assert vertex_cover(star) == [5]
    assert vertex_cover([*star, (20, 21)]) == [5, 20]
