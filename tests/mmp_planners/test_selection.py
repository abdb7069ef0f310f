"""Which node of the open list is taken next."""

import pytest
from arms_on_a_line import node

from mmp_planners.selection import Focal

# Two arms each; both at place 1 at step 1 is one conflict, and to wait there is another.
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
    """Repulsion raises costs and leaves bounds alone: all nodes can cost more than w times the bound."""
    high, low = node(0, *CHEAP, bounds=[2, 1]), node(1, *DEAR, bounds=[1, 1])
    assert (high.cost, low.cost) == (4, 8)
    assert Focal(w=1.0)([high, low][::order], 2.0) is low
    older = node(0, *TWICE, bounds=[1, 1])
    assert Focal(w=1.0)([older, low][::order], 2.0) is older
