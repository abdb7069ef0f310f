"""`mmp report --against`: published figures beside ours."""

import json

import pytest

pytestmark = pytest.mark.usefixtures("figures_unrendered")
HEAD = "instance,planner,solved,planning_time_s,cost_rad\n"


def solved(instance, planner, time, cost):
    return {
        "instance": instance,
        "planner": planner,
        "status": "solved",
        "planning_time_s": time,
        "cost_rad": cost,
        "cost_lower_bound_rad": 1.0,
        "makespan_s": 1.0,
    }


@pytest.fixture
def folder(tmp_path):
    """Returns a folder in which our planner solves x and y of ring, not z; w is invalid. A second cell has an x too."""
    lines = [
        solved("ring/x", "ours", 1.0, 2.0),
        solved("ring/y", "ours", 3.0, 4.0),
        {"instance": "ring/z", "planner": "ours", "status": "timeout"},
        {"instance": "ring/w", "planner": "ours", "status": "invalid"},
        solved("row/x", "ours", 1.0, 50.0),
    ]
    (tmp_path / "results.jsonl").write_text("".join(json.dumps(x) + "\n" for x in lines))
    return tmp_path


@pytest.fixture
def against(mmp, folder, tmp_path_factory):
    """Runs the report against a CSV of that content and name."""

    def run(content, *more, name="ring.published.csv"):
        path = tmp_path_factory.mktemp("csv") / name
        path.write_text(content, encoding="utf-8")
        return mmp("report", folder, "--against", path, *more)

    return run


GOOD = HEAD + "x,THEIRS,1,10,4\ny,THEIRS,0,,\nz,THEIRS,1,20,6\nw,THEIRS,1,1,1\nelsewhere,THEIRS,1,1,1\n"


def test_published_figures_stand_beside_ours_on_the_common_valid_instances(against, folder):
    assert against(GOOD, "--against-note", "C++, 60 s").code == 0
    text = (folder / "table.md").read_text()
    assert "| ours | ours | 2 of 3 (67 %) | 2.00 s | 2.80 s | 2.00 ± 1.41 | 3.00 ± 1.41 |" in text
    assert "| THEIRS | published | 2 of 3 (67 %) | 15.0 s | 19.0 s | 15.0 ± 7.07 | 5.00 ± 1.41 |" in text
    assert "On the 3 instances that both have" in text
    assert "Left out: w (invalid here: the results do not say why); elsewhere (not in these results)." in text
    assert (folder / "published-ring.png").exists()


def test_the_results_give_the_reason_for_an_omitted_instance(against, folder):
    why = "start: joint 1 of arm 'left' is 9 rad, out of limits"
    with (folder / "results.jsonl").open("a") as results:
        results.write(json.dumps({"instance": "ring/v", "planner": "ours", "status": "invalid", "message": why}) + "\n")
    assert against(HEAD + "x,THEIRS,1,1,4\nv,THEIRS,1,1,4\n").code == 0
    text = (folder / "table.md").read_text()
    assert f"Left out: v (invalid here: {why})." in text
    assert "with our geometry: v" not in text


def test_a_published_cost_below_the_straight_lines_is_left_out_and_named(against, folder):
    assert against(HEAD + "x,THEIRS,1,10,0.5\ny,THEIRS,1,10,0.995\n").code == 0
    text = (folder / "table.md").read_text()
    assert "On the 1 instance that both have" in text
    assert "Left out: x (the published cost of THEIRS, 0.50" in text
    assert "| THEIRS | 4.00 / 0.99" in text


def test_costs_are_compared_where_both_solve(against, folder):
    against(GOOD)
    assert "| THEIRS | 2.00 / 4.00 = 0.50 (1) |" in (folder / "table.md").read_text()


def test_the_machine_of_published_figures_is_stated_where_it_is_known(against, folder):
    against(GOOD)
    assert "the file does not say on what machine" in (folder / "table.md").read_text()
    against("# laptop of 2020\n# limit 60 s\n" + GOOD)
    assert "Published: ring.published.csv, laptop of 2020; limit 60 s." in (folder / "table.md").read_text()
    against("# laptop\n" + GOOD, "--against-note", "C++")
    assert "ring.published.csv, C++; laptop." in (folder / "table.md").read_text()


def test_a_full_name_means_its_cell_with_any_file_name(against, folder):
    assert against(HEAD + "row/x,THEIRS,1,1,25\n", name="any.csv").code == 0
    assert "| THEIRS | 50.0 / 25.0 = 2.00 (1) |" in (folder / "table.md").read_text()


def test_a_published_planner_that_solves_nothing_is_shown_as_such(against, folder):
    assert against(HEAD + "y,THEIRS,0,,\n").code == 0
    assert "| THEIRS | published | 0 of 1 (0 %) | – | – | – | – |" in (folder / "table.md").read_text()


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "has no column 'instance'"),
        ("# only a comment\n", "has no column 'instance'"),
        ("instance,planner,solved,planning_time_s\nx,A,1,1\n", "has no column 'cost_rad'"),
        (HEAD, "has no result below its head"),
        (HEAD + "x,A,1\n", "line 2 has 3 columns; its head has 5"),
        ("# c\n\n" + HEAD + "x,A,perhaps,1,1\n", "line 4: unknown value of solved 'perhaps'"),
        (HEAD + "x,A,1,fast,1\n", "line 2: planning_time_s is 'fast'"),
        (HEAD + "x,A,1,-1,1\n", "line 2: planning_time_s is '-1'"),
        (HEAD + "x,A,1,1,inf\n", "line 2: cost_rad is 'inf'"),
        (HEAD + "x,A,1,,1\n", "line 2 is solved and has no planning_time_s"),
        (HEAD + "x,,1,1,1\n", "line 2 has no planner"),
        (HEAD + "x,A,1,1,1\nx,A,0,,\n", "line 3 has instance 'x' of 'A' a second time"),
        (HEAD + "q,A,1,1,1\n", "has no instance in common with the results"),
        (HEAD + 'x,A,1,1,"1\n', "line 2 is not CSV"),
        (HEAD + f"x,{'A' * 2**18},1,1,1\n", "line 2 is not CSV"),
    ],
)
def test_a_bad_file_is_one_sentence_and_nothing_is_written(against, folder, content, sentence):
    ran = against(content)
    assert (ran.code, ran.out) == (2, "")
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
    assert [path.name for path in folder.iterdir()] == ["results.jsonl"]


def test_a_bare_name_that_could_be_of_two_cells_is_refused(against):
    ran = against(HEAD + "x,A,1,1,1\n", name="results.csv")
    assert ran.code == 2
    assert "instance 'x' could be of ring, row" in ran.err


def test_a_file_that_cannot_be_read_is_one_sentence(mmp, folder):
    ran = mmp("report", folder, "--against", folder / "none.csv")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "cannot be read" in ran.err


def test_a_note_without_published_figures_is_refused(mmp, folder):
    ran = mmp("report", folder, "--against-note", "C++")
    assert ran.code == 2
    assert "--against FILE" in ran.err
