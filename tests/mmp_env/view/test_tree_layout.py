import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mmp_env.errors import MmpError
from mmp_env.view.tree_layout import BETWEEN_TREES, layout

TINY = 1e-9


@st.composite
def forests(draw, most=60):
    """Returns the parents of a random forest, with nodes in random order."""
    count = draw(st.integers(1, most))
    parents = [None, *(draw(st.none() | st.integers(0, k - 1)) for k in range(1, count))]
    names = draw(st.permutations(range(count)))
    out = [None] * count
    for node, parent in enumerate(parents):
        out[names[node]] = None if parent is None else names[parent]
    return out


def families(parents):
    """Returns parent -> its children in order."""
    out = {}
    for node, parent in enumerate(parents):
        if parent is not None:
            out.setdefault(parent, []).append(node)
    return out


def root_of(parents, node):
    while parents[node] is not None:
        node = parents[node]
    return node


def below(parents, node):
    """Returns the nodes of a subtree."""
    out = [node]
    for each in out:
        out.extend(families(parents).get(each, []))
    return out


def assert_apart(places):
    for depth in set(places[:, 1]):
        across = np.sort(places[places[:, 1] == depth, 0])
        assert (np.diff(across) >= 1 - TINY).all()


@given(forests())
def test_y_is_the_depth(parents):
    places = layout(parents)
    for node, parent in enumerate(parents):
        assert places[node, 1] == (0 if parent is None else places[parent, 1] + 1)


@given(forests())
def test_nodes_of_a_level_are_at_least_1_apart_and_the_left_border_is_0(parents):
    places = layout(parents)
    assert_apart(places)
    assert places[:, 0].min() == pytest.approx(0, abs=TINY)


@given(forests())
def test_a_parent_stands_over_the_middle_of_its_first_and_last_child(parents):
    places = layout(parents)
    for parent, children in families(parents).items():
        ends = places[[children[0], children[-1]], 0]
        assert places[parent, 0] == pytest.approx(ends.mean())


@given(forests())
def test_children_and_all_below_them_stand_in_their_order(parents):
    places = layout(parents)
    for children in families(parents).values():
        for one, other in itertools.pairwise(children):
            ours, theirs = places[below(parents, one)], places[below(parents, other)]
            for depth in set(ours[:, 1]) & set(theirs[:, 1]):
                assert ours[ours[:, 1] == depth, 0].max() < theirs[theirs[:, 1] == depth, 0].min()


@given(forests(most=20))
def test_the_same_subtree_has_the_same_shape_wherever_it_is(parents):
    count = len(parents)
    around = [None, 0, *(1 if parent is None else parent + 2 for parent in parents), 0, count + 2]
    roots_apart = layout([None, *(0 if parent is None else parent + 1 for parent in parents)])
    found = layout(around)[2 : count + 2]
    assert found - found[0] == pytest.approx(roots_apart[1:] - roots_apart[1])


@given(forests())
def test_trees_of_a_forest_do_not_reach_into_each_others_columns(parents):
    places = layout(parents)
    roots = [node for node, parent in enumerate(parents) if parent is None]
    ends = [places[below(parents, root), 0] for root in roots]
    for one, other in itertools.pairwise(ends):
        assert other.min() - one.max() == pytest.approx(BETWEEN_TREES)


@given(forests(), st.floats(0, 30))
def test_rows_are_no_wider_than_asked_and_share_no_level(parents, width):
    places, single = layout(parents, width=width), layout(parents)
    assert_apart(places)
    rows = {}
    for root in (node for node, parent in enumerate(parents) if parent is None):
        tree = below(parents, root)
        assert places[tree] - places[root] == pytest.approx(single[tree] - single[root])
        rows.setdefault(places[root, 1], []).append(tree)
    deepest = -1
    for top in sorted(rows):
        nodes = places[[node for tree in rows[top] for node in tree]]
        assert nodes[:, 0].max() <= width + TINY or len(rows[top]) == 1
        assert top == deepest + 1
        deepest = nodes[:, 1].max()


def test_subtrees_are_as_close_as_possible():
    #     0        the right subtree fits beside the chain of the left one,
    #    1  2      one node away
    #    3  4 5
    assert layout([None, 0, 0, 1, 2, 2]).tolist() == [
        [0.75, 0.0],
        [0.0, 1.0],
        [1.5, 1.0],
        [0.0, 2.0],
        [1.0, 2.0],
        [2.0, 2.0],
    ]


def test_a_chain_and_a_comb_of_ten_thousand_nodes():
    chain = layout([None, *range(9999)])
    assert (chain == np.column_stack([np.zeros(10_000), np.arange(10_000)])).all()
    comb = layout([None, *(node // 2 * 2 for node in range(9999))])
    assert_apart(comb)


def test_an_empty_tree_has_no_positions():
    assert layout([]).shape == (0, 2)


@pytest.mark.parametrize(
    ("parents", "words"),
    [([None, 2, 1], "node 1 hangs from no root"), ([0], "node 0 hangs"), ([None, 5], "parent 5"), ([None, -1], "-1")],
)
def test_parents_that_are_no_tree_are_refused(parents, words):
    with pytest.raises(MmpError, match=words):
        layout(parents)
