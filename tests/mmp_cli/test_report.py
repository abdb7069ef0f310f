"""`mmp report` on small folders made by hand, with numbers that are easy to compute."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image
from support.report_folders import folder_of, line, row, settings

from mmp_cli.main import main

ODD = "_b|<i>$x$ `é` \u6f22"
"""Label with characters that are special in HTML, Markdown and matplotlib, or missing in its font."""


RING = [
    # Planner a solves 0, 1, 2 in 1, 2, 6 s with 2, 4, 6 nodes; b solves 1, 2, 3.
    line("ring/0", "a", planning_time_s=1.0, expanded_nodes=2, cost_rad=11.0, makespan_s=2.0, root_conflicts=4,
         workers=2, load=2.5),
    line("ring/1", "a", planning_time_s=2.0, expanded_nodes=4, cost_rad=12.0, makespan_s=3.0, root_conflicts=0,
         workers=1, load=1.5),
    line("ring/2", "a", planning_time_s=6.0, expanded_nodes=6, cost_rad=13.0, makespan_s=4.0, root_conflicts=8),
    line("ring/3", "a", "timeout", planning_time_s=10.0, deadline_hit=True, root_conflicts=20),
    line("ring/4", "a", "invalid", message="arm0 touches arm1 at the start"),
    line("ring/1", ODD, planning_time_s=0.5, expanded_nodes=0, cost_rad=18.0, root_conflicts=2,
         fast_track_tries=3, fast_track_hits=1, bound_met=True, deadline_hit=False, min_clearance_m=0.0021),
    line("ring/2", ODD, planning_time_s=1.5, expanded_nodes=3, cost_rad=14.0, bound_met=False, deadline_hit=True,
         fast_track_tries=2, fast_track_hits=0, min_clearance_m=0.0012),
    line("ring/3", ODD, planning_time_s=2.5, expanded_nodes=9, cost_rad=16.0, fast_track_tries=0,
         fast_track_hits=0),
    line("ring/0", ODD, "exhausted"),
    line("ring/4", ODD, "invalid"),
    line("files/night", "a", "error", message="the worker was killed: <script>alert('x')</script> & more"),
    line("files/day", "a", planning_time_s=0.001),
]  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Returns the folder of a report over two cells."""
    folder = folder_of(tmp_path_factory.mktemp("bench"), RING, settings(ODD, "a", "late"))
    assert main(command(folder)) == 0
    return folder


def command(folder):
    (folder / "ring.csv").write_text(f"instance,planner,solved,planning_time_s,cost_rad\n1,{ODD},1,3,14\n2,B,1,9,15\n")
    return ["report", str(folder), "--against", str(folder / "ring.csv")]


@pytest.fixture(scope="module")
def table(made):
    return (made / "table.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(made):
    return (made / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def words(page):
    """Returns the text of the page as a reader sees it."""
    parts = []

    class Text(HTMLParser):
        def handle_data(self, data):
            parts.append(data)

    Text().feed(re.sub(r"<(svg|style).*?</\1>", "", page, flags=re.DOTALL))
    return " ".join(" ".join(parts).split())


def test_a_report_says_what_ran_at_the_same_time(table):
    assert "Runs at a time: 1 or 2; load of the machine, median: 2.0, at most 2.5." in table


def test_the_main_table_has_means_over_solved_and_success_over_valid_instances(table):
    assert row(table, "Success, nodes, time, makespan and cost", "a") == {
        "planner": "a",
        "solved": "3 of 4 (75 %)",
        "expanded nodes": "4.00 ± 2.00",
        "planning time \\[s\\]": "3.00 ± 2.65",
        "makespan \\[s\\]": "3.00 ± 1.00",
        "cost \\[rad\\]": "12.0 ± 1.00",
    }


def test_the_page_explains_its_tables_in_words_not_in_names_of_the_code(words):
    assert "a planner that solves only the easy instances looks good here" in words
    assert re.findall(r"\b[a-z]+_[a-z]+\b", words) == []


@pytest.mark.usefixtures("figures_unrendered")
def test_one_figure_is_no_plural(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a", "invalid")], settings("a", count=1))
    ran = mmp("report", folder)
    assert (ran.code, ran.out) == (0, f"{folder / 'report.html'}, table.md and 1 figure as SVG and PNG\n")


def test_means_count_commonly_solved_instances_only(table):
    assert row(table, "Where all of them solve", "a")["expanded nodes"] == "5.00 ± 1.41"
    assert "over the 2 instances solved by all of them" in table


def test_the_details_have_quantiles_cost_ratios_and_statistics_of_the_planner(table):
    name = next(x for x in table.splitlines() if x.startswith("| \\_b")).split(" | ")[0].removeprefix("| ")
    odd, a = (row(table, "Time and cost in detail", label) for label in (name, "a"))
    assert (a["median"], a["90 %"], a["longest"]) == ("1.200", "5.20 s", "6.00 s")
    assert a["cost ratio, mean"] == "1.200"
    assert a["largest"] == "1.300"
    assert (a["cut short"], a["bound met"], a["clearance proved"]) == ("1 of 4", "–", "–")
    assert (odd["bound met"], odd["cut short"], odd["clearance proved"]) == ("1 of 3", "1 of 4", "1.2 mm of all kinds")


def test_the_proved_clearance_is_that_of_the_required_kinds(mmp, tmp_path, figures_unrendered):
    asked = {"arms": 0.03, "obstacles": 0.02, "self": None}
    lines = [
        line(f"ring/{k}", "a", min_clearance_m=0.00328, margins_asked=asked,
             margins_proved={"arms": arms, "obstacles": 0.0209, "self": 0.00328})
        for k, arms in enumerate((0.0312, 0.03))
    ]  # fmt: skip
    lines.append(line("ring/2", "a", "invalid", margins_asked=asked, message="nearer than 30 mm"))
    lines.append(line("ring/0", "old", min_clearance_m=0.00328))
    folder = folder_of(tmp_path, lines, settings("a", "old", margin={"arms": 0.03, "obstacles": 0.02}))
    assert mmp("report", folder).code == 0
    text = (folder / "table.md").read_text(encoding="utf-8")
    proved = [row(text, "Time and cost in detail", label)["clearance proved"] for label in ("a", "old")]
    assert proved == ["30 mm between arms, 20.9 mm to obstacles", "3.28 mm of all kinds"]
    assert "in collision, out of limits or closer than a margin asked for" in text


def test_the_fast_track_has_its_tries_and_hits(table):
    block = table.split("### Fast track\n\n")[1]
    assert "| 5 | 1 of 5 (20 %) | 1 of 3 (33 %) |" in block


def test_the_overview_says_how_hard_a_cell_is(table):
    assert row(table, "Cells", "ring") == {
        "cell": "ring",
        "arms": "4",
        "instances": "5",
        "invalid": "1",
        "solved by no planner": "0",
        # Per instance 4, (0 + 2) / 2, 8 and 20.
        "root conflicts": "6.00 / 16.4 / 20.0",
        "none at the root": "0 of 4 (0 %)",
    }


def test_a_single_value_has_no_standard_deviation(table):
    single = table.split("## files\n")[1]
    assert row(single, "Success, nodes, time, makespan and cost", "a")["planning time \\[s\\]"] == "0.00100"


def test_every_failed_and_invalid_instance_and_every_error_is_named(words):
    for expected in (
        "a timeout 1 3",
        "exhausted 1 0",
        "4 arm0 touches arm1 at the start",
        "a files/night 0 the worker was killed: <script>alert('x')</script> & more",
        "1 unit ended in an ERROR",
        "Solved by no planner: night.",
    ):
        assert expected in words


def test_missing_units_are_counted_per_planner(words):
    # Five instances for each of three planners; "late" has not begun.
    assert "The run is not finished: 5 of 15 units are missing (late 5)." in words


def test_the_page_states_machine_versions_and_command(words, made):
    for expected in (
        "a test, 1 core",
        "mmp-env: 0.1.0",
        "Time limit: 10 s",
        "margin asked: 2 mm between arms, 2 mm to obstacles",
        f"mmp report {made.name}",
    ):
        assert expected in words
    assert "mmp bench ring --planners" in words
    assert f"mmp report {made}" not in words, "a page that is passed on says nothing of the machine it was made on"


def test_the_page_needs_nothing_from_elsewhere_and_runs_nothing(page):
    tags = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag, attrs):
            tags.append((tag, dict(attrs)))

    Tags().feed(page)
    assert {"script", "link", "img", "iframe", "object"}.isdisjoint(tag for tag, _ in tags)
    targets = [value for _, attrs in tags for key, value in attrs.items() if key in ("src", "href", "xlink:href")]
    assert targets
    assert all(target.startswith("#") for target in targets)
    assert not re.search(r"@import|url\((?!#)", page)
    ids = [attrs["id"] for _, attrs in tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    assert {target.removeprefix("#") for target in targets} <= set(ids)


def test_labels_are_escaped_everywhere(page, table):
    assert "_b|&lt;i&gt;$x$ `é` \u6f22" in page
    assert "<i>" not in page + table.split("## Made again by")[0]
    assert "\\_b\\|&lt;i&gt;\\$x\\$ \\`é\\` \u6f22" in table


def edge_is_white(picture):
    pixels = np.asarray(picture.convert("L"))
    return min(edge.min() for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1])) == 255


def test_every_figure_is_there_as_svg_and_png_and_shows_something(made):
    names = {path.stem for path in made.glob("*.png")}
    assert (
        names
        == {path.stem for path in made.glob("*.svg")}
        == {"success", "cactus-ring", "pairs-ring", "cactus-files", "published-ring"}
    )
    for path in made.glob("*.png"):
        picture = Image.open(path).convert("RGB")
        assert picture.width > 400
        assert len(picture.getcolors(picture.width * picture.height)) > 20
        assert edge_is_white(picture), "something is cut off"
    for path in made.glob("*.svg"):
        assert path.read_text(encoding="utf-8").startswith("<?xml")


def test_the_same_results_make_the_same_files(made, capsys):
    before = {path.name: path.read_bytes() for path in made.iterdir()}
    assert main(command(made)) == 0
    assert {path.name: path.read_bytes() for path in made.iterdir()} == before
    assert "1 unit ended in an ERROR" in capsys.readouterr().err
