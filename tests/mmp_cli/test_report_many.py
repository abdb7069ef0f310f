"""A report of ten planners, some of them without a conflict tree: distinct styles and empty cells."""

import dataclasses
import re
from itertools import combinations

import numpy as np
import pytest
from support.report_folders import folder_of, line, row, settings

from mmp_cli.main import main
from mmp_cli.reporting import cactus_figure, pairs_figure
from mmp_cli.reporting.figure_style import plot_styles
from mmp_cli.reporting.results import read_results
from mmp_cli.reporting.sections import sections
from mmp_env.view.tree_drawing.colors import contrast

LABELS = [f"p{k}" for k in range(10)]
TREELESS = {"p0": {"expanded_nodes": 0, "generated_nodes": 0}, "p1": {"expanded_nodes": None}}
"""Planners without counts of nodes: the first did not need its tree, the second has none."""
PAGES = "#ffffff", "#16191d"
COLOUR_VISION = {
    "everyone": np.eye(3),
    "no green": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "no red": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
}
"""Colour vision -> matrix of linear red, green, blue, after Machado et al. 2009."""
TO_OKLAB = (
    np.array([[0.4122, 0.5363, 0.0514], [0.2119, 0.6807, 0.1074], [0.0883, 0.2817, 0.6300]]),
    np.array([[0.2105, 0.7936, -0.0041], [1.9780, -2.4286, 0.4506], [0.0259, 0.7828, -0.8087]]),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Returns a folder of ten planners on three instances. The first grew a tree on the last instance alone."""
    lines = [
        line(f"ring/{k}", label, planning_time_s=1.0 + k, **{"expanded_nodes": 4 + k, "generated_nodes": 9} | more)
        for label in LABELS
        for k, more in enumerate([TREELESS.get(label, {})] * 2 + [TREELESS.get(label, {}) if label == "p1" else {}])
    ]
    return folder_of(tmp_path_factory.mktemp("bench"), lines, settings(*LABELS, count=3))


@pytest.fixture(scope="module")
def section(folder):
    (found,) = sections(read_results(folder).lines, LABELS)
    return found


def oklab(color, seen_as):
    shares = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    light = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return TO_OKLAB[1] @ np.cbrt(TO_OKLAB[0] @ np.clip(np.array(seen_as) @ light, 0, 1))


@pytest.mark.parametrize(("eyes", "least"), [("everyone", 0.15), ("no green", 0.07), ("no red", 0.07)])
def test_ten_colours_can_be_distinguished(eyes, least):
    colors = {style.colour for style in plot_styles(LABELS).values()}
    assert len(colors) == len(LABELS)
    seen = [oklab(color, COLOUR_VISION[eyes]) for color in colors]
    assert min(np.linalg.norm(one - other) for one, other in combinations(seen, 2)) > least


def test_every_colour_is_visible_on_a_light_and_on_a_dark_page():
    for style in plot_styles(LABELS).values():
        assert min(contrast(style.colour, page) for page in PAGES) > 2.2, style


def test_no_two_of_forty_planners_look_the_same():
    every = {
        (style.colour, style.marker, str(style.dashes)) for style in plot_styles([str(k) for k in range(40)]).values()
    }
    assert len(every) == 40


def figure_and_caption(monkeypatch, module, *arguments):
    """Returns the figure of a module before it is written, and its caption."""
    figures, rendered = [], module.rendered
    monkeypatch.setattr(module, "rendered", lambda figure, *more: figures.append(figure) or rendered(figure, *more))
    drawing = getattr(module, module.__name__.rpartition(".")[2])(*arguments)
    return figures[0], drawing.caption


@pytest.mark.parametrize("count", [7, 10])
def test_many_planners_have_a_panel_of_the_cactus_plot_each(section, monkeypatch, count):
    some = dataclasses.replace(section, runs=section.runs[:count])
    figure, _ = figure_and_caption(monkeypatch, cactus_figure, some, plot_styles(LABELS), "cactus", 10.0)
    shown = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_title(loc="left") for axes in shown] == LABELS[:count]
    for axes in shown:
        assert len(axes.lines) == count + 1, "its own curve and all of them in grey"


def test_planners_without_a_tree_leave_no_hole_among_the_nodes(section, monkeypatch):
    figure, caption = figure_and_caption(monkeypatch, pairs_figure, section, "p5", plot_styles(LABELS), "pairs")
    assert all(axes.get_visible() for axes in figure.axes)
    below = [axes.get_xlabel().split("\n")[0] for axes in figure.axes[4:]]
    assert below == ["p0", "p2", "p3", "p4"]
    assert not [axes for axes in figure.axes if re.search("×0$", axes.get_title(loc="left"))]
    assert caption.endswith("Without a conflict tree, and so without nodes: p1.")


def test_the_ratio_of_a_pair_states_its_number_of_instances(tmp_path, monkeypatch):
    counts = {"a": (0, 0, 4), "b": (0, 0, 8), "c": (1, 1, 1)}
    lines = [line(f"ring/{k}", x, expanded_nodes=count) for x in counts for k, count in enumerate(counts[x])]
    (found,) = sections(read_results(folder_of(tmp_path, lines)).lines, list(counts))
    figure, _ = figure_and_caption(monkeypatch, pairs_figure, found, "a", plot_styles(list(counts)), "pairs")
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[:3:2] == ["3 instances, ×1", "1 of 3 instances, ×2"]


def test_a_planner_without_a_tree_has_a_dash_with_a_note_and_no_zero(folder):
    assert main(["report", str(folder)]) == 0
    table = (folder / "table.md").read_text(encoding="utf-8")
    for title in ("Success, nodes, time, makespan and cost", "Where all of them solve"):
        nodes = {label: row(table, title, label)["expanded nodes"] for label in ("p0", "p1", "p2")}
        assert nodes == {"p0": "6.00 (1 of 3)", "p1": "–", "p2": "5.00 ± 1.00"}
    assert table.count("–: the planner has grown no conflict tree, or has solved nothing.") == 2
    assert table.count("In brackets: on how many of the solved a conflict tree has grown") == 2


def test_the_report_has_the_required_margin_and_the_proved_clearance(folder):
    assert main(["report", str(folder)]) == 0
    for name in ("table.md", "report.html"):
        text = (folder / name).read_text(encoding="utf-8")
        assert "margin asked: 2 mm between arms, 2 mm to obstacles" in text
        assert "clearance proved" in text
        assert "least clearance" not in text.lower()
