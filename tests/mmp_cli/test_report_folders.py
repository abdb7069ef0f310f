"""`mmp report` on folders that are unfinished, torn, odd or no benchmark at all."""

import json

import pytest
from support.report_folders import folder_of, line, settings

pytestmark = pytest.mark.usefixtures("figures_unrendered")


def test_the_command_of_the_benchmark_has_the_names_of_files_and_not_their_places(mmp, tmp_path):
    sources = ("MultiArmCell-4", "mmp_env:MultiArmCell-6", "/home/somebody/cells/ring.json", "../with space.yaml")
    folder = folder_of(tmp_path, [line("ring/0", "a")], settings("a", sources=sources))
    assert mmp("report", folder).code == 0
    page, table = (folder / "report.html").read_text(), (folder / "table.md").read_text()
    assert "mmp bench MultiArmCell-4 mmp_env:MultiArmCell-6 ring.json 'with space.yaml' --planners a" in table
    assert "--planners a" in page
    assert "missing of ring.json, with space.yaml is not known" in page
    assert "somebody" not in page + table


def test_a_cut_off_last_line_is_left_out_and_mentioned(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a"), line("ring/1", "a")], end="\n" + '{"instance": "ring/2", "pl')
    ran = mmp("report", folder)
    assert ran.code == 0
    assert "cut off" in ran.err
    assert "2 of 2 (100 %)" in (folder / "table.md").read_text()


def test_results_without_settings_work_and_say_so(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")])
    assert mmp("report", folder, "--title", "A <title>").code == 0
    text = (folder / "table.md").read_text()
    assert text.startswith("# A &lt;title&gt;\n")
    assert "limits and options are not known" in text
    assert sorted(path.name for path in folder.glob("*.png")) == ["cactus-ring.png", "success.png"]


def test_a_repeated_unit_counts_once(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a"), line("ring/0", "a", "timeout")])
    ran = mmp("report", folder)
    assert "1 line left out" in ran.err
    assert "1 of 1 (100 %)" in (folder / "table.md").read_text()


@pytest.mark.parametrize("status", ["timeout", "error", "invalid"])
def test_a_folder_with_nothing_solved_has_a_report_too(mmp, tmp_path, status):
    folder = folder_of(
        tmp_path, [line("ring/0", "a", status), line("ring/0", "b", status)], settings("a", "b", count=1)
    )
    assert mmp("report", folder).code == 0
    assert [path.name for path in folder.glob("*.png")] == ["success.png"]
    valid = 0 if status == "invalid" else 1
    assert f"| a | 0 of {valid}" in (folder / "table.md").read_text()


def test_a_planner_without_counts_has_a_row_without_numbers(mmp, tmp_path):
    lines = [line(f"ring/{k}", planner) for k in range(3) for planner in ("a", "b")]
    bare = {"expanded_nodes": None, "cost_rad": None, "makespan_s": None}
    folder = folder_of(tmp_path, [x | bare if x["planner"] == "b" else x for x in lines])
    assert mmp("report", folder).code == 0
    assert "| b | 3 of 3 (100 %) | – | 1.00 ± 0 | – | – |" in (folder / "table.md").read_text()


def test_a_reference_can_be_chosen(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", planner) for planner in ("first", "apf-ecbs", "last")])
    assert mmp("report", folder, "--reference", "first").code == 0
    assert "below the diagonal first needs less" in (folder / "report.html").read_text()
    ran = mmp("report", folder, "--reference", "fist")
    assert ran.code == 2
    assert "Did you mean 'first'?" in ran.err


def test_units_of_several_seeds_are_distinct(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/x", "a", seed=0), line("ring/x", "a", "timeout", seed=1)])
    assert mmp("report", folder).code == 0
    assert "| a | timeout | 1 | x (seed 1) |" in (folder / "table.md").read_text()


@pytest.mark.parametrize(
    ("content", "sentence"),
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
def test_a_bad_results_file_is_one_sentence_and_nothing_is_written(mmp, tmp_path, content, sentence):
    (tmp_path / "results.jsonl").write_text(content, encoding="latin-1")
    ran = mmp("report", tmp_path)
    assert (ran.code, ran.out) == (2, "")
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["results.jsonl"]


def test_a_missing_or_empty_folder_is_one_sentence(mmp, tmp_path):
    assert "is not a folder" in mmp("report", tmp_path / "none").err
    ran = mmp("report", tmp_path)
    assert ran.code == 2
    assert "has no results.jsonl" in ran.err


def test_bad_settings_are_one_sentence(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")], {"schema": "mmp-bench/1", "sources": 3})
    ran = mmp("report", folder)
    assert ran.code == 2
    assert "settings.json: sources is 3" in ran.err


def test_a_target_that_cannot_be_replaced_leaves_no_half_report(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")])
    (folder / "success.png").mkdir()
    (folder / "success.png" / "keep").touch()
    ran = mmp("report", folder)
    assert ran.code == 2
    assert "cannot be written" in ran.err
    assert not (folder / "report.html").exists()
    assert not list(folder.glob(".mmp-*"))
