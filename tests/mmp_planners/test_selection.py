"""Selection of the next node of the open list."""

import numpy as np
import pytest
from support.arms_on_a_line import node

from mmp_planners.conflict_tree.constraints import Branch
from mmp_planners.conflict_tree.selection import BestFirst, Focal, FocalPerKind

# Each node has two arms. Both at place 1 at step 1 is one conflict; waiting there is another.
CHEAP, TWICE = [(0, 1, 2), (2, 1, 0)], [(0, 1, 1, 2), (2, 1, 1, 0)]
DEAR = [(0, -2, 2), (2, 1, 0)]


def test_focal_takes_the_fewest_conflicts_among_those_within_w_times_the_bound():
    within, beyond, worse = node(0, *CHEAP), node(1, *DEAR), node(2, *TWICE)
    assert [n.conflict_count for n in (within, beyond, worse)] == [1, 0, 2]
    assert [n.cost for n in (within, beyond, worse)] == [4, 8, 4]
    assert Focal(w=1.0)([worse, within, beyond], 4.0) is within
    assert Focal(w=1.9)([worse, within, beyond], 4.0) is within
    assert Focal(w=2.0)([worse, within, beyond], 4.0) is beyond


def test_focal_prefers_fewer_pairs_then_less_cost_then_the_older_node():
    one_pair = node(3, (0, 1, 1, 2), (2, 1, 1, 0), (9,))
    two_pairs = node(0, (0, 1, 2), (2, 1, 0), (2, 9))
    assert one_pair.conflict_count == two_pairs.conflict_count == 2
    assert Focal(w=9.0)([two_pairs, one_pair], 4.0) is one_pair
    dear = node(0, (0, 1, 2, 3), (2, 1, 0, -1))
    old, new = node(1, *CHEAP), node(2, *CHEAP)
    assert Focal(w=9.0)([dear, new, old], 4.0) is old


@pytest.mark.parametrize("order", [1, -1])
def test_an_empty_focal_falls_back_to_the_least_bound(order):
    """Repulsion raises costs but not bounds, so all nodes can cost more than w times the bound."""
    high, low = node(0, *CHEAP, bounds=[2, 1]), node(1, *DEAR, bounds=[1, 1])
    assert (high.cost, low.cost) == (4, 8)
    assert Focal(w=1.0)([high, low][::order], 2.0) is low
    older = node(0, *TWICE, bounds=[1, 1])
    assert Focal(w=1.0)([older, low][::order], 2.0) is older


def test_best_first_takes_the_cheapest_then_the_fewest_conflicts_then_the_oldest():
    dear, cheap, twice = node(0, *DEAR), node(2, *CHEAP), node(1, *TWICE)
    assert (dear.conflict_count, BestFirst().w) == (0, 1.0)
    assert BestFirst()([dear, twice, cheap], 4.0) is cheap
    older = node(1, *CHEAP)
    assert BestFirst()([cheap, older], 4.0) is older


class ScriptedBandit:
    """A bandit that draws given choices, and records what it learns."""

    def __init__(self, *draws):
        self.draws, self.learned = list(draws), []

    def draw(self):
        return self.draws.pop(0)

    def learn(self, choice, won):
        self.learned.append((choice, won))


def of_kinds(number, kinds, places, **more):
    n = node(number, *places, **more)
    n.kinds = kinds
    return n


def test_the_list_of_a_kind_prefers_fewer_conflicts_then_nodes_of_that_kind_then_cheap_ones():
    fewest = of_kinds(0, (0,), [(0, 1, 2), (9, 9, 9)])
    first, second, mixed = (of_kinds(k, kinds, CHEAP) for k, kinds in ((1, (0, 0)), (2, (1, 1)), (3, (0, 1))))
    dear = of_kinds(4, (1, 1), [(0, 1, 3), (2, 1, 0)])
    open_nodes = [first, dear, second, mixed]
    assert FocalPerKind(w=2.0, bandit=ScriptedBandit(1))(open_nodes, 4.0) is first
    assert FocalPerKind(w=2.0, bandit=ScriptedBandit(2))(open_nodes, 4.0) is second
    assert FocalPerKind(w=2.0, bandit=ScriptedBandit(2))([mixed, first], 4.0) is mixed
    assert FocalPerKind(w=2.0, bandit=ScriptedBandit(2))([*open_nodes, fewest], 4.0) is fewest


def test_the_lists_of_kinds_hold_what_costs_at_most_w_times_the_bound_and_the_anchor_list_all():
    within, beyond = node(0, *TWICE), node(1, *DEAR, bounds=[1, 1])
    assert FocalPerKind(w=1.5, bandit=ScriptedBandit(1))([beyond, within], 4.0) is within
    assert FocalPerKind(w=1.5, bandit=ScriptedBandit(0))([within, beyond], 4.0) is beyond
    assert FocalPerKind(w=1.5, bandit=ScriptedBandit(1))([beyond], 4.0) is beyond, "an empty list: the least bound"


@pytest.mark.parametrize(("left", "won"), [(0, True), (1, False), (2, False)])
def test_a_list_wins_where_replanning_the_node_it_gave_leaves_fewer_conflicts(left, won):
    bandit = ScriptedBandit(2, 1, 1)
    select = FocalPerKind(w=9.0, bandit=bandit)
    waiting = node(0, *CHEAP)
    waiting.pending = Branch(arm=0, constraints=(), description="")
    assert select([waiting], 4.0) is waiting
    waiting.pending = None
    waiting.update(conflicts={(0, 1): np.arange(float(left))} if left else {})
    select([node(1, *CHEAP)], 4.0)
    assert bandit.learned == [(2, won)]
    select([node(1, *CHEAP)], 4.0)
    assert bandit.learned == [(2, won)], "a node that is branched teaches nothing"
