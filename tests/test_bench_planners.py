"""`scripts/bench_planners.py`: rows of planners and sources become figures, a JSON line each."""

import json
from functools import partial

import bad_files
import checkout_scripts
import pytest

run = partial(checkout_scripts.run, "bench_planners.py")


def test_a_row_becomes_figures_of_each_planner_on_each_source(tmp_path):
    (tmp_path / "pairs.json").write_text(json.dumps(bad_files.good_instances()))
    (tmp_path / "pairs.published.csv").write_text(
        "instance,planner,solved,planning_time_s,cost_rad\nturn,XECBS,1,0.1,2.0\nturn,ECBS,1,0.1,9.0\nother,XECBS,0,,\n"
    )
    row = f"ecbs,ecbs w=2.0,apf-ecbs@MultiArmCell-2,{tmp_path}/pairs.json@20"
    ran = run(row, "--count", 1, "--twice", 1, "--published", tmp_path / "pairs.published.csv")
    assert ran.returncode == 0, ran.stderr
    figures = {figure["name"]: figure for figure in map(json.loads, ran.stdout.splitlines())}
    for source in ("MultiArmCell-2", "pairs"):
        for planner in ("ecbs", "ecbs w=2.0", "apf-ecbs"):
            name = f"{source}/{planner}"
            assert (figures[f"{name}/solved"]["value"], figures[f"{name}/solved"]["failed"]) == (1, {})
            for figure in ("plans_failing_check", "plans_failing_exact_check", "plan_files_that_differ"):
                assert figures[f"{name}/{figure}"]["value"] == 0
            for figure in ("planning_time_median", "expanded_nodes_mean", "cost_median", "cost_mean"):
                assert figures[f"{name}/{figure}"]["value"] >= 0
    beside = figures["pairs/apf-ecbs/cost_mean_beside_published"]
    assert (beside["value"], beside["ratio"], beside["instances"]) == (1.0, 0.5, 1)
    assert figures["pairs/ecbs/expanded_nodes_where_both_solve"]["instances"] == 1


def test_fewer_than_no_instances_are_not_planned_again():
    ran = run("--twice", -1)
    assert ran.returncode == 2
    assert ran.stderr == "bench_planners.py: argument --twice: '-1' is not a whole number from 0 to 999999999\n"


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("nobody@MultiArmCell-2", "unknown planner 'nobody'"),
        ("ecbs colour=red@MultiArmCell-2", "planner 'ecbs' has no option 'colour'"),
        ("ecbs@MultiArmCell-2@soon", "the time limit 'soon'; it must be a number of seconds"),
        ("ecbs@nowhere.json", "nowhere.json"),
        ("ecbs", "row 'ecbs' names no source"),
    ],
)
def test_a_row_that_means_nothing_is_one_sentence(row, words):
    ran = run(row)
    assert ran.returncode == 2
    assert ran.stdout == ""
    assert words in ran.stderr
    assert "Traceback" not in ran.stderr
