"""Tables and figures in the paper's form are those of the raw results."""

import gzip
import importlib
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLANNERS = ("ecbs", "apf-ecbs-nf", "apf-ecbs")
NODES = {"ecbs": (6, 10, 50), "apf-ecbs-nf": (2, 6, None), "apf-ecbs": (1, 3, 9)}
"""Expanded nodes of each planner on three instances; None is a timeout."""


@pytest.fixture
def paper_tables(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    return importlib.import_module("paper_tables")


@pytest.fixture
def folder(tmp_path):
    lines = []
    for planner, counts in NODES.items():
        for k, nodes in enumerate(counts):
            line = {
                "instance": f"MultiArmCell-4/{k}",
                "cell": "MultiArmCell-4",
                "arms": 4,
                "planner": planner,
                "seed": k,
            }
            if nodes is None:
                lines.append(line | {"status": "timeout"})
                continue
            solved = {"status": "solved", "expanded_nodes": nodes, "planning_time_s": nodes / 10, "makespan_s": 8.0}
            track = {"fast_track_tries": 2, "fast_track_hits": 1} if planner == "apf-ecbs" else {}
            lines.append(line | solved | track | {"cost_rad": 40.0})
    (tmp_path / "results.jsonl.gz").write_bytes(
        gzip.compress("".join(f"{json.dumps(line)}\n" for line in lines).encode())
    )
    planners = [{"label": name, "name": name, "options": {}} for name in PLANNERS]
    (tmp_path / "settings.json").write_text(json.dumps({"planners": planners}))
    return tmp_path


def test_table_one_has_success_beside_the_papers_and_means(paper_tables, folder):
    _, ecbs, without, ours = paper_tables.table_one(folder)
    assert ecbs[:3] == ["4", "`ecbs`", "3 of 3 (100 %); paper: 76 %"]
    assert without[2] == "2 of 3 (67 %)"
    assert ours[3].startswith("4.33 ±")


def test_figure_five_is_relative_to_apf_ecbs_where_all_solve(paper_tables, folder, tmp_path):
    _, ecbs, without = paper_tables.figure_five_table(folder)
    assert ecbs == ["4", "2", "`ecbs`", "4.00", "4.00", "1.00", "1.00"]
    assert without[:4] == ["4", "2", "`apf-ecbs-nf`", "2.00"]
    paper_tables.save_figures(folder, tmp_path / "figures")
    drawn = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert drawn == ["figure-4.svg", "figure-5.svg"]


def test_pairs_are_compared_where_both_solve_enough(paper_tables, folder, monkeypatch):
    monkeypatch.setitem(paper_tables.PAIRS, folder.name, (("ecbs", "apf-ecbs"), ("ecbs", "not-run")))
    _, row = paper_tables.pair_table(folder)
    assert row == ["4", "`ecbs` / `apf-ecbs`", "3, 3 of 3", "3", *["–"] * 5]
    monkeypatch.setattr("paired.LEAST_BOTH", 3)
    _, row = paper_tables.pair_table(folder)
    assert row[4] == "5.08 (3.71 to 5.64)"
    assert row[7:] == ["1.00 (1.00 to 1.00)"] * 2


def test_the_trade_off_has_a_point_for_each_measured_planner_and_option(paper_tables):
    trade_off = importlib.import_module("trade_off")
    figures = {
        "cells/MultiArmCell-4/apf-ecbs/expanded_nodes_mean": {"value": 2.0},
        "cells/MultiArmCell-4/ecbs/expanded_nodes_where_both_solve": {"value": 8.0, "ratio": 4.0},
        "cells/MultiArmCell-4/ecbs/cost_rad_where_both_solve": {"value": 40.0, "ratio": 0.5},
        "repulsion/apf-ecbs shorten=100/nodes_ring-4": {"value": 2.0},
        "repulsion/apf-ecbs shorten=100/cost_ring-4": {"value": 30.0, "ratio": 1.25},
    }
    found = [(point.label, point.nodes, point.cost) for point in trade_off.points(figures, 4)]
    assert found == [("apf-ecbs", 2.0, 1.0), ("ecbs", 8.0, 0.5), ("shorten=100", 2.0, 0.8)]
    assert list(trade_off.points(figures, 6)) == []
    assert trade_off.trade_off_figure(figures).name == "nodes-cost"


def test_an_option_that_was_not_measured_has_dashes(paper_tables):
    tables = importlib.import_module("planner_tables")
    what = {"instances": 5, "seeds": 1, "solved": 5, "solved_base": 4, "value": 2.0, "of_base": 4.0, "ratio": 2.0}
    label = "repulsion/apf-ecbs shorten=400"
    figures = {f"{label}/{name}_ring-4": what | {"time_limit_s": 30.0} for name in ("nodes", "time", "cost")}
    rows = {(row[0], row[1]): row[2:] for row in tables.repulsion_table(figures)}
    assert rows["`apf-ecbs shorten=400`", "`ring-4`"] == ["30 s", "4 of 5", "5 of 5", "4", "2", "0.50", "0.500"]
    assert rows["`apf-ecbs shorten=400`", "`ring-6`"] == ["–"] * 7


def test_the_fast_track_is_compared_where_both_solve(paper_tables, folder):
    _, row = paper_tables.fast_track_table(folder)
    assert row == ["4", "2", "4.00", "2.00", "50 %", "0.400", "0.200", "0.400", "0.200", "3 of 6 (50 %)"]


def test_a_table_of_nodes_has_dashes_where_ecbs_has_none(paper_tables):
    tables = importlib.import_module("planner_tables")
    figure = {"name": "solved", "value": 0.0, "ratio": 0.0, "instances": 2}
    names = ("MultiArmCell-4/ecbs/solved", "MultiArmCell-4/ecbs/expanded_nodes_where_both_solve")
    _, row = tables.node_table(dict.fromkeys(names, figure))
    assert row == ["MultiArmCell-4", "2", "0", tables.NOT_MEASURED, tables.NOT_MEASURED]
