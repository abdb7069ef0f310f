"""The verdicts on the paper's claims follow from the raw results by one rule."""

import gzip
import importlib
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def module(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    return importlib.import_module


def kept(path, nodes):
    """Writes a kept benchmark on one cell: planner -> nodes of each instance; None is a timeout."""
    path.mkdir()
    lines = []
    for planner, counts in nodes.items():
        for k, count in enumerate(counts):
            line = {"instance": f"MultiArmCell-4/{k}", "cell": "MultiArmCell-4", "arms": 4, "planner": planner}
            solved = {"status": "solved", "expanded_nodes": count, "planning_time_s": 0.1, "makespan_s": 8.0}
            rest = {"status": "timeout"} if count is None else solved | {"cost_rad": 40.0}
            lines.append(json.dumps(line | {"seed": k} | rest))
    (path / "results.jsonl.gz").write_bytes(gzip.compress("".join(f"{line}\n" for line in lines).encode()))
    (path / "settings.json").write_text(json.dumps({"planners": [{"label": name} for name in nodes]}))


@pytest.fixture
def rows(module, tmp_path):
    kept(tmp_path / "preset", {"ecbs-paper": [9] * 6, "apf-ecbs-nf-paper": [4] * 6, "paper": [None, *[9] * 5]})
    kept(
        tmp_path / "cells",
        {"ecbs": [9] * 6, "gen-ecbs": [1, 2, 3, 30, 4, 5], "apf-ecbs-nf": [6] * 6, "apf-ecbs": [3] * 6},
    )
    return {row[0]: row[1:3] for row in module("claims").claims_table(tmp_path)}


def test_a_claim_holds_if_the_whole_interval_is_in_its_favour(rows):
    assert rows["fewer expanded nodes than ECBS"] == ["**no**: 1.00", "**yes**: 3.00"]
    assert rows["the fast track saves nodes"] == ["**no**: 0.444", "**yes**: 2.00"]
    assert rows["Gen-ECBS expands fewer nodes than ECBS"] == ["not measured", "**open**: 1.20"]


def test_cost_is_judged_by_its_distance(rows):
    assert rows["cost close to that of ECBS"] == ["**yes**: 1.00", "**yes**: 1.00"]


def test_success_is_judged_by_the_instances_that_only_one_solves(module, tmp_path, rows):
    assert rows["solves more than ECBS"] == ["**open**: 5 (6) of 6, only by one 0 (1)", "**equal**: 6 (6) of 6"]
    kept(tmp_path / "more", {"ecbs": [*[None] * 5, 9], "apf-ecbs": [9] * 6, "worse": [*[9] * 5, None]})
    (section,) = module("measured").kept_sections(tmp_path / "more")
    claims, pair = module("claims"), module("paired").pair
    assert claims.more_solved(pair(section, "ecbs", "apf-ecbs")) == ("yes", "6 (1) of 6, only by one 5 (0)")
    assert claims.more_solved(pair(section, "apf-ecbs", "ecbs")) == ("no", "1 (6) of 6, only by one 0 (5)")
    assert claims.more_solved(pair(section, "ecbs", "worse")) == ("open", "5 (1) of 6, only by one 5 (1)")


def test_a_sign_test_needs_five_wins_without_a_loss(module):
    significant = module("claims").significant
    assert [significant(wins, 0) for wins in range(7)] == [False] * 5 + [True] * 2
    assert [significant(wins, 1) for wins in range(5, 9)] == [False, False, True, True]


def test_cells_that_disagree_are_named(module):
    claims = module("claims")
    words = iter([("yes", "2.0"), ("open", "1.1")])
    claim = claims.Claim(words="", labels=lambda planners: ("", ""), judge=lambda each: next(words))
    cells = [type("Each", (), {"section": type("Cell", (), {"arms": arms})})() for arms in (4, 6)]
    assert claims.judged(claim, cells) == "4 arms **yes**: 2.0; 6 arms **open**: 1.1"


def test_the_fast_track_of_the_paper_is_compared_with_none(module, tmp_path, rows):
    assert rows["the paper's fast track saves nodes, with our other defaults"] == ["see above", "not measured"]
    kept(tmp_path / "literal", {"literal-track": [2] * 6})
    (pair,) = module("claims").literal_track(tmp_path)
    assert (pair.theirs.label, pair.ratio("expanded_nodes").value) == ("apf-ecbs-nf", 3.0)
    assert module("claims").literal_track(tmp_path, ("track",)) == []


def test_the_summary_counts_rows_that_are_the_same_in_all_cells(module):
    rows = [["a", "**yes**: 2", "see above"], ["b", "4 arms **yes**: 2; 6 arms **no**: 1", "**no**: 1"]]
    first, second = module("claims").summary(rows).split("\n")[1:3]
    assert first == "With preset `paper`, 1 of 2 rows are **yes** in every cell, and 0 **no**."
    assert second == "With our defaults, 0 of 1 rows are **yes** in every cell, and 1 **no**."


def test_fewer_than_five_instances_solved_by_both_leave_a_claim_open(module, tmp_path):
    kept(tmp_path / "cells", {"ecbs": [9] * 4, "apf-ecbs": [3] * 4})
    (section,) = module("measured").kept_sections(tmp_path / "cells")
    assert module("paired").pair(section, "ecbs", "apf-ecbs").ratio("expanded_nodes") is None
    assert module("paired").pair(section, "ecbs", "none") is None
    assert module("claims").verdict(None) == "open"


def test_the_interval_of_equal_ratios_is_a_point_and_contains_the_ratio_else(module):
    interval = module("resampling").interval
    assert interval([4, 8, 2], [2, 4, 1]) == (2.0, 2.0)
    low, high = interval([1, 2, 3, 30], [1, 1, 1, 1])
    assert low < 9 < high
    assert interval([3, 3], [0, 0], least=1.0) == (6.0, 6.0)
