"""The study of the paper's claims: its settings, and tables and heat maps that are those of the raw results."""

import gzip
import importlib
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from mmp_planners import make
from mmp_planners.apf_ecbs import ApfEcbs

ROOT = Path(__file__).parents[1]


@pytest.fixture
def module(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    return importlib.import_module


@pytest.fixture
def folder(module, tmp_path):
    """A kept study in which larger steps halve the nodes; the last instance is not solved with the paper's steps."""
    study, lines = module("study"), []
    labels = study.study_variants("improve=200")
    for label in labels:
        for k, nodes in enumerate((10, 20, 20, 20, 30, 30)):
            line = {"instance": f"MultiArmCell-4/{k}", "cell": "MultiArmCell-4", "arms": 4, "planner": label, "seed": k}
            if k == 5 and label == study.Setting().label:
                lines.append(line | {"status": "timeout", "expanded_nodes": 70})
                continue
            nodes = nodes / 2 if label == study.LARGER_STEPS.label else nodes
            lines.append(line | {"status": "solved", "expanded_nodes": nodes, "planning_time_s": 0.1, "cost_rad": 40.0})
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    (tmp_path / "results.jsonl.gz").write_bytes(gzip.compress(text.encode()))
    planners = [{"label": label} for label in labels]
    (tmp_path / "settings.json").write_text(json.dumps({"planners": planners, "time_limit_s": 2.0}))
    return tmp_path


def test_the_settings_differ_from_the_preset_in_the_options_of_the_study_only(module):
    study = module("study")
    variants = study.study_variants("improve=200")
    assert len(variants) == len(set(variants.values()))
    paper = dict(word.split("=") for word in variants[study.Setting().label].split())
    defaults = {field.name: field.default for field in ApfEcbs.__dataclass_fields__.values()}
    assert paper.pop("preset") == "paper"
    assert paper.pop("distance") == ApfEcbs.presets["paper"]["distance"]
    assert {name: float(value) for name, value in paper.items()} == {
        name: defaults[name] for name in ("d0", "alpha", "max_iterations", "radius")
    }


def test_alpha_is_varied_over_six_decades(module):
    alphas = [float(alpha) for alpha in module("study").ALPHAS]
    assert max(alphas) / min(alphas) == pytest.approx(1e6)


def test_each_setting_has_a_baseline_with_the_same_radius(module):
    study = module("study")
    variants = study.study_variants("improve=200")
    for row in study.radii():
        for setting in row:
            assert variants[setting.baseline] == f"improve=200 radius={setting.radius}"
            assert f"radius={setting.radius}" in variants[setting.label]


def test_a_setting_is_compared_with_the_baseline_where_both_solve(module, folder):
    study, tables = module("study"), module("study_tables")
    (section,) = module("measured").kept_sections(folder)
    paper, larger = (tables.compared(section, setting) for setting in (study.Setting(), study.LARGER_STEPS))
    assert (paper.solved, paper.solved_before, paper.both, paper.nodes) == (5, 6, 5, 1.0)
    assert (larger.solved, larger.both, larger.nodes, larger.time, larger.cost) == (6, 6, 2.0, 1.0, 1.0)
    assert (paper.holds, larger.holds) == (False, True)


def test_the_table_names_the_steps_with_fewer_nodes(module, folder):
    rows = list(module("study_tables").steps_table(folder))
    assert rows[0][2] == "α, 4 arms"
    assert rows[2][:3] == ["centre", "0.2", "1e-4 (n = 6)"]
    assert rows[1][2] == "none (n = 5 to 6)"
    assert [row[:2] for row in rows[4:]] == [["surface", d0] for d0 in ("0.05", "0.1", "0.2")]
    verdict = module("study_tables").verdict(folder)
    assert "for 1 of the" in verdict
    assert "and for 1 in all cells:\n`distance=centre d0=0.2 alpha=1e-4`." in verdict


def test_too_few_instances_solved_by_both_give_no_ratio(module, folder):
    study, tables = module("study"), module("study_tables")
    packed = folder / "results.jsonl.gz"
    lines = gzip.decompress(packed.read_bytes()).decode().splitlines()
    kept = "".join(f"{line}\n" for line in lines if "Cell-4/4" not in line)
    packed.write_bytes(gzip.compress(kept.encode()))
    (section,) = module("measured").kept_sections(folder)
    cell = tables.compared(section, study.Setting())
    assert (cell.both, cell.nodes, cell.compares, cell.holds) == (4, None, False, False)


def test_a_setting_that_was_not_run_has_no_row(module, folder):
    packed = folder / "results.jsonl.gz"
    lines = gzip.decompress(packed.read_bytes()).decode().splitlines()
    kept = "".join(f"{line}\n" for line in lines if "surface-0.05" not in line)
    packed.write_bytes(gzip.compress(kept.encode()))
    rows = list(module("study_tables").steps_table(folder))
    assert [row[1] for row in rows if row[0] == "surface"] == ["0.1", "0.2"]


@pytest.mark.parametrize(
    ("nodes", "text"),
    [((1, 2, 1, 2, 2, 3, 1), "1e-7, 1e-5 to 1e-3 (n = 9)"), ((1,) * 7, "none (n = 9)"), ((None,) * 7, "–")],
)
def test_neighbouring_values_of_alpha_are_a_range(module, nodes, text):
    row, tables = module("study").steps("centre")[0], module("study_tables")
    cells = [
        tables.Compared(solved=1, solved_before=1, both=4 if x is None else 9, nodes=x, time=None, cost=None)
        for x in nodes
    ]
    assert tables._holding(row, cells) == text


def test_the_table_of_long_limits_counts_what_is_solved_within_parts_of_the_limit(module, folder):
    rows = {row[1]: row for row in module("study_tables").long_table(folder)}
    assert rows["planner"][2:5] == ["solved in 0.02 s", "solved in 0.2 s", "solved in 2 s"]
    assert rows[f"`{module('study').Setting().label}`"][2:] == ["0 of 6", "5 of 6", "5 of 6", "70"]


def test_the_heat_maps_have_a_field_for_each_setting(module, folder, tmp_path):
    module("study_tables").save_heat_maps(folder, tmp_path)
    for name in module("study_tables").PICTURES:
        root = ET.fromstring((tmp_path / f"{name}.svg").read_text(encoding="utf-8"))
        assert root.tag.endswith("svg")


def test_the_sizes_of_a_step_on_the_page_are_those_of_the_formula():
    """Step of a joint with a lever of 1 m, by one pair of spheres: alpha k_rep (1/d - 1/d_0) / d^2."""
    page = (ROOT / "docs" / "results" / "README.md").read_text(encoding="utf-8")
    paper = make("apf-ecbs", preset="paper")

    def step_rad(d):
        return paper.alpha * paper.k_rep * (1 / d - 1 / paper.d0) / d**2

    assert f"At d = 0.09 m, k_rep = {paper.k_rep:g} and α = 1e-7" in page
    assert f"{step_rad(0.09):.1e} rad".replace("e-07", "e-7") in page
    assert f"moves the joint by {1e3 * step_rad(make('apf-ecbs').floor):.1f} mrad" in page
