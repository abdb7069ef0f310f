import itertools
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import drawn_shapes, grown_trees

from mmp_env.view.search_tree import SearchTree
from mmp_env.view.tree_drawing.colors import FREE, conflict_color, luminance, text_color
from mmp_env.view.tree_drawing.svg import cut, quoted, text_width, wrapped

SIZES = {"one": 1, "boxes": 5, "most boxes": 40, "numbered": 60, "dots": 400, "many dots": 1200}


def drawing(count, trees=1, **more):
    """Returns a tree of `count` nodes with everything that a drawing can show."""
    rng = np.random.default_rng(count + trees)
    parents = grown_trees.forest(rng, count, trees)
    leaves = sorted(set(range(count)) - set(parents))
    conflicts = rng.integers(1, 200, count).tolist()
    conflicts[leaves[-1]] = 0
    fast = {leaves[-1]} if parents[leaves[-1]] is not None else set()
    tree = grown_trees.grown(parents, conflicts=conflicts, solution=leaves[-1], fast_tracks=fast, **more)
    return tree, *drawn_shapes.read(tree.svg())


def of_nodes(shapes, *kinds):
    return [shape for shape in shapes if shape.node is not None and shape.kind in kinds]


def bodies(shapes):
    """Returns one shape of each node."""
    return list({shape.node: shape for shape in of_nodes(shapes, "rect", "circle", "polygon")[::-1]}.values())


def assert_nothing_overlaps(shapes):
    for one, other in neighbours(bodies(shapes)):
        assert not one.overlaps(other), (one, other)
    texts = [shape for shape in shapes if shape.kind == "text"]
    for one, other in neighbours(texts):
        assert not one.overlaps(other), (one, other)
    for text, body in itertools.product(texts, bodies(shapes)):
        assert not text.overlaps(body, 0.1) or (text.node == body.node and body.holds(text, 0.5)), (text, body)


def neighbours(shapes):
    """Yields pairs that could overlap, in order from the top down."""
    shapes = sorted(shapes, key=lambda shape: shape.top)
    for k, one in enumerate(shapes):
        for other in itertools.takewhile(lambda other, one=one: other.top < one.bottom, shapes[k + 1 :]):
            yield one, other


@pytest.mark.parametrize("count", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("trees", [1, 4])
def test_every_node_and_every_edge_is_drawn_once(count, trees):
    tree, root, shapes = drawing(count, trees)
    groups = [element for element in root.iter() if element.get("data-node") is not None]
    assert sorted(int(element.get("data-node")) for element in groups) == list(range(count))
    assert {shape.node for shape in bodies(shapes)} == set(range(count))
    edges = {(int(element.get("data-from")), int(element.get("data-to"))) for element in root.iter() if edge(element)}
    assert edges == {(node.parent, node.id) for node in tree.nodes if node.parent is not None}


def edge(element):
    return element.get("data-from") is not None


@pytest.mark.parametrize("count", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("trees", [1, 4])
def test_neither_nodes_nor_texts_overlap_and_all_is_within_the_panel(count, trees):
    _, root, shapes = drawing(count, trees)
    assert_nothing_overlaps(shapes)
    width, height = float(root.get("width")), float(root.get("height"))
    for shape in shapes:
        assert shape.left >= 0
        assert shape.top >= 0
        assert shape.right <= width
        assert shape.bottom <= height


@pytest.mark.parametrize("trees", [9, 300])
def test_captions_of_a_large_forest_are_as_large_as_its_title_and_overlap_nothing(trees):
    _, root, shapes = drawing(1800, trees)
    assert_nothing_overlaps(shapes)
    assert all(shape.left >= 0 and shape.right <= float(root.get("width")) for shape in shapes)
    texts = [element for element in root.iter() if re.fullmatch(r"(tree )?\d+", element.text or "")]
    sizes = {float(text.get("font-size")) for text in texts if text.get("text-anchor") == "middle"}
    scale = float(re.search(r"scale\(([\d.]+)\)", ElementTree.tostring(root, "unicode"))[1])
    assert 14 < min(sizes) == max(sizes) == pytest.approx(12 * scale, rel=0.05)


def test_numbers_of_three_digits_in_discs_are_as_large_as_others():
    root, _ = drawn_shapes.read(grown_trees.grown([None, *range(59)], conflicts=[1, 22, 333] * 20).svg())
    texts = [e for e in root.iter() if drawn_shapes.named(e) == "text" and e.text in ("1", "22", "333")]
    sizes = {e.text: float(e.get("font-size")) for e in texts if e.get("text-anchor") == "middle"}
    assert sizes == {"1": 12, "22": 12, "333": 12}


WORDS = st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "Zs"], max_codepoint=0x17F), max_size=80)
LONG = st.sampled_from(["the_left_arm_of_the_second_packing_line avoids the_right_one at 12.5 s", "W" * 60, ""])


@settings(max_examples=40)
@given(st.data(), st.integers(1, 70), st.integers(0, 2**20))
def test_no_text_overlaps_another_with_any_constraint(data, count, seed):
    rng = np.random.default_rng(seed)
    parents = grown_trees.forest(rng, count, int(rng.integers(1, 4)))
    pool = data.draw(st.lists(WORDS | LONG, min_size=1, max_size=4))
    constraints = [pool[k % len(pool)] for k in range(count)]
    tree = grown_trees.grown(parents, constraints=constraints, conflicts=rng.integers(0, 10_000, count).tolist())
    assert_nothing_overlaps(drawn_shapes.read(tree.svg())[1])


def test_a_tooltip_contains_every_known_fact():
    tree = grown_trees.grown([None, 0], solution=1)
    for event in (grown_trees.branched(0), grown_trees.fast_tracked(0, solved=False)):
        tree(event)
    root, _ = drawn_shapes.read(tree.svg())
    tips = [element[0].text for element in root.iter() if element.get("data-node") is not None]
    for words in ("node 0", "3 conflicts between 1 pair", "cost 10.00 rad", "lower bound 9.00", "number 1"):
        assert words in tips[0]
    for words in ("branched on: left and right meet at 2.0 to 2.5 s", "fast track with left: failed", "0.500 s"):
        assert words in tips[0]
    for words in ("node 1", "left avoids right at 2.0 s", "not expanded", "on the path to the solution"):
        assert words in tips[1]


def test_a_small_tree_has_its_constraints_as_text_on_the_edges():
    words = ["", "left avoids right at 2.0 s", "right avoids left at 2.0 s"]
    _, _, shapes = drawing(3, constraints=words)
    for node in (1, 2):
        said = " ".join(shape.text for shape in shapes if shape.node == node and shape.kind == "text")
        assert words[node] in said or "fast track" in said


def test_a_large_tree_has_the_path_to_the_solution_as_text():
    tree, root, _ = drawing(400)
    texts = [element.text for element in root.iter() if drawn_shapes.named(element) == "text"]
    assert "The path to the solution" in texts
    assert any(text.endswith("no conflict") for text in texts)
    assert len(tree.solution_path) > 2


@pytest.mark.parametrize("count", [5, 60, 400])
def test_solution_path_fast_track_and_expansion_differ(count):
    tree, root, _ = drawing(count)
    widths = {int(e.get("data-to")): float(e.get("stroke-width")) for e in root.iter() if edge(e)}
    on = {widths[node.id] for node in tree.nodes if node.on_solution_path and node.id in widths}
    off = {width for node, width in widths.items() if not tree.nodes[node].on_solution_path}
    assert min(on) > 2 * max(off, default=1)
    groups = {int(e.get("data-node")): e for e in root.iter() if e.get("data-node") is not None}
    polygons = {node for node, group in groups.items() if any(drawn_shapes.named(part) == "polygon" for part in group)}
    assert polygons == {node.id for node in tree.nodes if node.fast_track}
    looks = {
        looked_at: {
            (part.get("r"), part.get("stroke-dasharray"))
            for node in tree.nodes
            if bool(node.expanded) is looked_at and not node.on_solution_path
            for part in groups[node.id]
            if drawn_shapes.named(part) in ("circle", "rect") and part.get("stroke-width")
        }
        for looked_at in (False, True)
    }
    assert looks[False].isdisjoint(looks[True])


def test_the_legend_has_exactly_the_marks_of_the_drawing():
    plain = grown_trees.grown([None]).svg()
    assert "fast track" not in plain
    assert "path to the solution" not in plain
    full = drawing(400)[0].svg()
    for words in ("conflicts", "expanded", "generated, not expanded", "fast track", "path to the solution"):
        assert words in full


def test_a_tree_without_nodes_says_so():
    root, shapes = drawn_shapes.read(SearchTree(title="nothing").svg())
    assert "no node" in " ".join(shape.text for shape in shapes)
    assert float(root.get("width")) > 0


def test_nodes_without_numbers_are_drawn():
    tree = SearchTree(title="strange")
    tree(grown_trees.branched(3))
    _, shapes = drawn_shapes.read(tree.svg())
    assert "unknown" in {shape.text for shape in shapes}
    assert "nan" not in tree.svg()


def test_characters_that_xml_forbids_are_replaced_and_markup_is_text():
    strange = 'a<b>&"c"\x00\x1b[31m\ud800 ]]>'
    tree = grown_trees.grown([None, 0], constraints=[None, strange], title=strange)
    root = ElementTree.fromstring(tree.svg())
    texts = " ".join(element.text or "" for element in root.iter())
    assert '<b>&"c"' in texts
    assert "\x1b" not in texts
    assert quoted("ok <") == "ok &lt;"


def test_a_drawing_fetches_nothing_and_does_not_change_the_page_around_it():
    svg = drawing(5)[0].svg()
    assert re.findall(r"(?:href|src|url|@import)", svg) == []
    style = re.search(r"<style>(.*?)</style>", svg, re.DOTALL)[1]
    selectors = re.findall(r"([^{}@]+)\{(?=[a-z-]+:)", re.sub(r"@media[^{]*\{", "", style))
    assert selectors
    assert all(selector.strip().startswith(".mmp-") for selector in selectors)


@given(st.integers(0, 5000), st.integers(1, 5000))
def test_text_on_a_node_has_contrast(conflicts, most):
    color = conflict_color(conflicts, max(conflicts, most))
    light, dark = sorted((luminance(color), luminance(text_color(color))))[::-1]
    assert (light + 0.05) / (dark + 0.05) >= 4.5


def test_more_conflicts_are_darker_and_none_is_of_another_colour():
    levels = [luminance(conflict_color(count, 150)) for count in range(1, 151)]
    assert all(a >= b for a, b in itertools.pairwise(levels))
    assert levels[0] > 4 * levels[-1]
    assert conflict_color(0, 150) == FREE
    red, blue = (int(FREE[k : k + 2], 16) for k in (1, 5))
    assert blue > red
    warm = [conflict_color(count, 150) for count in (1, 20, 80, 150)]
    assert all(int(color[1:3], 16) > int(color[5:7], 16) for color in warm)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=60), st.booleans())
def test_no_text_is_wider_than_its_estimate(text, bold):
    slack = 0.06 * 12.0 * len(text) if bold else 0.0  # some letters are bolder than the average
    assert drawn_shapes.text_size(text, 12.0, bold)[0] <= text_width(text, 12.0, bold=bold) + slack + 1.5


@given(st.text(st.sampled_from("abcW iil_-.2"), max_size=120), st.floats(30, 300), st.integers(1, 4))
def test_wrapped_text_fits_and_loses_only_its_end(text, width, lines):
    out = wrapped(text, 11.0, width, lines)
    assert len(out) <= lines
    assert all(text_width(line, 11.0) <= width for line in out)
    if not any(line.endswith("…") for line in out):
        assert " ".join(out).split() == text.split()


def test_a_number_keeps_its_unit_and_lines_are_balanced():
    assert wrapped("arm2 avoids arm3 at 2.0 s", 11.0, 120.0, 3) == ["arm2 avoids", "arm3 at 2.0 s"]
    assert cut("short", 12.0, 100.0) == "short"
    assert cut("a long title of a tree", 12.0, 60.0).endswith("…")
