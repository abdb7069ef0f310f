"""`mmp report` on small folders made by hand, whose numbers can be computed in the head."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from mmp_cli.main import main

ODD = "_b|<i>$x$ `é` \u6f22"
"""A label with all that HTML, Markdown, matplotlib and its font may trip over."""

unrendered = pytest.mark.usefixtures("figures_unrendered")


def line(instance, planner, status="solved", **more):
    """A line of results.jsonl, with what every line has."""
    cell, _, name = instance.partition("/")
    out = {"instance": instance, "planner": planner, "seed": int(name) if name.isdigit() else 0, "status": status}
    out |= {"cell": cell, "arms": 4, "planning_time_s": 1.0, "version": "0.1.0", "machine": "a test, 1 core"}
    if status == "solved":
        out |= {"cost_rad": 12.0, "cost_lower_bound_rad": 10.0, "makespan_s": 3.0, "expanded_nodes": 1}
    return out | more


def settings(*labels, sources=("ring",), count=5, **more):
    planners = [{"label": label, "name": "ecbs", "options": {}} for label in labels]
    out = {"schema": "mmp-bench/1", "sources": list(sources), "planners": planners, "count": count, "seed": 0}
    return out | {"time_limit_s": 10.0, "task": "reach", "margin": 0.002, "version": "0.1.0"} | more


def folder_of(path, lines, set_to=None, end="\n"):
    """A benchmark folder."""
    path.mkdir(exist_ok=True)
    (path / "results.jsonl").write_text("\n".join(json.dumps(x) for x in lines) + end, encoding="utf-8")
    if set_to is not None:
        (path / "settings.json").write_text(json.dumps(set_to))
    return path


def row(text, table, label):
    """The cells of a row of table.md, by the heads of its columns."""
    block = text.split(f"# {table}\n\n")[1].split("\n\n")[0].splitlines()
    head, *rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", x)[1:-1]] for x in block if "---" not in x]
    return dict(zip(head, next(cells for cells in rows if cells[0] == label), strict=True))


RING = [
    # Planner a solves 0, 1, 2 in 1, 2, 6 s with 2, 4, 6 nodes; b solves 1, 2, 3.
    line("ring/0", "a", planning_time_s=1.0, expanded_nodes=2, cost_rad=11.0, makespan_s=2.0, root_conflicts=4),
    line("ring/1", "a", planning_time_s=2.0, expanded_nodes=4, cost_rad=12.0, makespan_s=3.0, root_conflicts=0),
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
    """The folder of a report over two cells."""
    folder = folder_of(tmp_path_factory.mktemp("bench"), RING, settings(ODD, "a", "late"))
    assert main(command(folder)) == 0
    return folder


def command(folder):
    (folder / "ring.csv").write_text(f"instance,planner,solved,planning_time_s,cost_rad\n1,{ODD},1,3,4\n2,B,1,9,5\n")
    return ["report", str(folder), "--against", str(folder / "ring.csv")]


@pytest.fixture(scope="module")
def table(made):
    return (made / "table.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(made):
    return (made / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def words(page):
    """The text of the page as a reader sees it."""
    parts = []

    class Text(HTMLParser):
        def handle_data(self, data):
            parts.append(data)

    Text().feed(re.sub(r"<(svg|style).*?</\1>", "", page, flags=re.DOTALL))
    return " ".join(" ".join(parts).split())


def test_the_main_table_has_mean_and_standard_deviation_over_the_solved_and_success_over_the_valid(table):
    assert row(table, "Success, nodes, time, makespan and cost", "a") == {
        "planner": "a",
        "solved": "3 of 4 (75 %)",
        "expanded nodes": "4.00 ± 2.00",
        "planning time \\[s\\]": "3.00 ± 2.65",
        "makespan \\[s\\]": "3.00 ± 1.00",
        "cost \\[rad\\]": "12.0 ± 1.00",
    }


def test_where_all_solve_only_the_commonly_solved_count(table):
    assert row(table, "Where all of them solve", "a")["expanded nodes"] == "5.00 ± 1.41"
    assert "over the 2 instances solved by all of them" in table


def test_the_details_have_quantiles_cost_ratios_and_what_the_planner_said(table):
    name = next(x for x in table.splitlines() if x.startswith("| \\_b")).split(" | ")[0].removeprefix("| ")
    odd, a = (row(table, "Time and cost in detail", label) for label in (name, "a"))
    assert (a["median"], a["90 %"], a["longest"]) == ("1.200", "5.20 s", "6.00 s")
    assert a["cost ratio, mean"] == "1.200"
    assert a["largest"] == "1.300"
    assert (a["cut short"], a["bound met"], a["least clearance"]) == ("1 of 4", "–", "–")
    assert (odd["bound met"], odd["cut short"], odd["least clearance"]) == ("1 of 3", "1 of 4", "1.20 mm")


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
    for told in (
        "a timeout 1 3",
        "exhausted 1 0",
        "4 arm0 touches arm1 at the start",
        "a files/night 0 the worker was killed: <script>alert('x')</script> & more",
        "1 unit ended in an ERROR",
        "Solved by no planner: night.",
    ):
        assert told in words


def test_what_is_missing_is_counted_per_planner(words):
    # Five instances for each of three planners; "late" has not begun.
    assert "The run is not finished: 5 of 15 units are missing (late 5)." in words


def test_the_page_says_with_what_and_how_it_was_made(words, made):
    for told in ("a test, 1 core", "mmp-env: 0.1.0", "Time limit: 10 s", "margin 2 mm", f"mmp report {made.name}"):
        assert told in words
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


@unrendered
def test_a_cut_off_last_line_is_left_out_and_mentioned(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a"), line("ring/1", "a")], end="\n" + '{"instance": "ring/2", "pl')
    ran = mmp("report", folder)
    assert ran.code == 0
    assert "cut off" in ran.err
    assert "2 of 2 (100 %)" in (folder / "table.md").read_text()


@unrendered
def test_results_without_settings_work_and_say_so(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")])
    assert mmp("report", folder, "--title", "A <title>").code == 0
    text = (folder / "table.md").read_text()
    assert text.startswith("# A &lt;title&gt;\n")
    assert "limits and options are not known" in text
    assert sorted(path.name for path in folder.glob("*.png")) == ["cactus-ring.png", "success.png"]


@unrendered
def test_a_repeated_unit_counts_once(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a"), line("ring/0", "a", "timeout")])
    ran = mmp("report", folder)
    assert "1 line left out" in ran.err
    assert "1 of 1 (100 %)" in (folder / "table.md").read_text()


@unrendered
@pytest.mark.parametrize("status", ["timeout", "error", "invalid"])
def test_a_folder_with_nothing_solved_has_a_report_too(mmp, tmp_path, status):
    folder = folder_of(
        tmp_path, [line("ring/0", "a", status), line("ring/0", "b", status)], settings("a", "b", count=1)
    )
    assert mmp("report", folder).code == 0
    assert [path.name for path in folder.glob("*.png")] == ["success.png"]
    valid = 0 if status == "invalid" else 1
    assert f"| a | 0 of {valid}" in (folder / "table.md").read_text()


@unrendered
def test_a_planner_that_counts_nothing_has_no_numbers_but_a_place(mmp, tmp_path):
    lines = [line(f"ring/{k}", planner) for k in range(3) for planner in ("a", "b")]
    bare = {"expanded_nodes": None, "cost_rad": None, "makespan_s": None}
    folder = folder_of(tmp_path, [x | bare if x["planner"] == "b" else x for x in lines])
    assert mmp("report", folder).code == 0
    assert "| b | 3 of 3 (100 %) | – | 1.00 ± 0 | – | – |" in (folder / "table.md").read_text()


@unrendered
def test_a_reference_can_be_chosen(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", planner) for planner in ("first", "apf-ecbs", "last")])
    assert mmp("report", folder, "--reference", "first").code == 0
    assert "below the diagonal first needs less" in (folder / "report.html").read_text()
    ran = mmp("report", folder, "--reference", "fist")
    assert ran.code == 2
    assert "Did you mean 'first'?" in ran.err


@unrendered
def test_units_of_several_seeds_are_told_apart(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/x", "a", seed=0), line("ring/x", "a", "timeout", seed=1)])
    assert mmp("report", folder).code == 0
    assert "| a | timeout | 1 | x (seed 1) |" in (folder / "table.md").read_text()


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "holds no result yet"),
        ("\n", "holds no result yet"),
        ("[1]\n", "line 1 is [1]; it must be an object"),
        ("{]\n", "line 1 is not JSON"),
        ('{"instance": "ring/0", "planner": "a"}\n', "line 1: status is missing"),
        (json.dumps(line("ring/0", "a", "solve")) + "\n", "Did you mean 'solved'?"),
        (json.dumps(line("ring/0", "a", planning_time_s="1")) + "\n", "planning_time_s is '1'; it must be a number"),
        (json.dumps(line("ring/0", "a", cost_rad=float("nan"))) + "\n", "cost_rad is nan"),
        (json.dumps(line("ring/0", "a", planning_time_s=-1)) + "\n", "planning_time_s is -1"),
        ("\xff\n", "not text in UTF-8"),
    ],
)
def test_a_bad_results_file_is_one_sentence_and_nothing_is_written(mmp, tmp_path, content, told):
    (tmp_path / "results.jsonl").write_text(content, encoding="latin-1")
    ran = mmp("report", tmp_path)
    assert (ran.code, ran.out) == (2, "")
    assert told in ran.err
    assert ran.err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["results.jsonl"]


def test_a_folder_that_is_none_or_empty_is_one_sentence(mmp, tmp_path):
    assert "is not a folder" in mmp("report", tmp_path / "none").err
    ran = mmp("report", tmp_path)
    assert ran.code == 2
    assert "has no results.jsonl" in ran.err


def test_bad_settings_are_one_sentence(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")], {"schema": "mmp-bench/1", "sources": 3})
    ran = mmp("report", folder)
    assert ran.code == 2
    assert "settings.json: sources is 3" in ran.err


@unrendered
def test_a_target_that_cannot_be_replaced_leaves_no_half_report(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")])
    (folder / "success.png").mkdir()
    (folder / "success.png" / "keep").touch()
    ran = mmp("report", folder)
    assert ran.code == 2
    assert "cannot be written" in ran.err
    assert not (folder / "report.html").exists()
    assert not list(folder.glob(".mmp-*"))
