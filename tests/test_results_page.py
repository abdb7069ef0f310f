"""docs/results: scripts make its page from kept benchmarks; the script that measures refuses bad arguments."""

import gzip
import importlib
import importlib.util
import json
import re
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from support import checkout_scripts

from mmp_cli.arguments import setting
from mmp_env.errors import MmpError
from mmp_planners import make

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "README.md"

TABLE = """# A title

Machine: a test.

## Cells

| cell | arms |
| --- | ---: |
| MultiArmCell-4 | 4 |

## MultiArmCell-4

### Success, nodes, time, makespan and cost

| planner | solved | expanded nodes |
| --- | ---: | ---: |
| ecbs | 45 of 50 (90 %) | 3 |

A note.

### Time and cost in detail

not shown

## Made again by

    mmp bench
"""


@pytest.fixture
def results_page(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    spec = importlib.util.spec_from_file_location("results_page", ROOT / "scripts" / "results_page.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_chosen_tables_stand_between_the_marks(results_page, tmp_path):
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "table.md").write_text(TABLE)
    marks = "".join(f"<!-- table: {name} -->\nold\n<!-- end of table -->\n" for name in ("cells", "literal"))
    page = results_page.with_tables(marks, tmp_path)
    assert "old" not in page
    assert "Machine: a test." in page
    assert "### Cells\n\n| cell | arms |" in page
    assert "not shown" not in page
    assert "Made again" not in page
    assert page.count("Not run yet") == 1
    assert results_page.with_tables(page, tmp_path) == page


RUN = {"instance": "MultiArmCell-4/0", "planner": "ecbs", "status": "solved", "planning_time_s": 2.0, "cost_rad": 3.0}
SETTINGS = {
    "sources": ["MultiArmCell-4", "/home/someone/circle.json"],
    "planners": [{"label": "ecbs", "name": "ecbs", "options": {}}],
    "count": 2,
    "time_limit_s": 10.0,
}


def bench_folder(path, runs):
    path.mkdir(parents=True)
    (path / "results.jsonl").write_text("".join(json.dumps(RUN | run) + "\n" for run in runs))
    (path / "settings.json").write_text(json.dumps(SETTINGS))
    return path


def test_a_benchmark_on_the_page_is_kept_with_its_report_and_the_same_bytes(results_page, tmp_path):
    source, target = bench_folder(tmp_path / "cells", [{}]), tmp_path / "kept"
    for name in ("table.md", "success.png", "success.svg", "report.html"):
        (source / name).write_text(name)
    results_page.keep(source, target)
    first = {path.name: path.read_bytes() for path in target.iterdir()}
    kept = {"table.md", "success.svg", "settings.json", "condition.json", "results.jsonl.gz"}
    assert set(first) == kept
    assert gzip.decompress(first["results.jsonl.gz"]) == (source / "results.jsonl").read_bytes()
    (target / "stale.svg").touch()
    results_page.keep(source, target)
    assert {path.name: path.read_bytes() for path in target.iterdir()} == first


def test_another_benchmark_is_kept_with_settings_condition_and_results(results_page, tmp_path):
    source = bench_folder(tmp_path / "others", [{}])
    (source / "table.md").touch()
    (tmp_path / "conditions").mkdir()
    (tmp_path / "conditions" / "others.json").write_text('{"commit": "abc"}')
    results_page.keep(source, tmp_path / "kept")
    names = {path.name for path in (tmp_path / "kept").iterdir()}
    assert names == {"settings.json", "condition.json", "results.jsonl.gz"}
    assert json.loads((tmp_path / "kept" / "condition.json").read_text()) == {"commit": "abc"}
    settings = json.loads((tmp_path / "kept" / "settings.json").read_text())
    assert settings == SETTINGS | {"sources": ["MultiArmCell-4", "circle.json"]}


def test_no_kept_benchmark_names_a_folder():
    for path in PAGE.parent.glob("*/settings.json"):
        assert not [source for source in json.loads(path.read_text(encoding="utf-8"))["sources"] if "/" in source], path


def test_times_count_solved_instances_only(results_page, tmp_path):
    runs = [{}, {"instance": "MultiArmCell-4/1", "status": "timeout", "planning_time_s": 10.0, "cost_rad": None}]
    (tmp_path / "measured").mkdir()
    bench_folder(tmp_path / "measured" / "others", runs)
    results_page.keep_all(tmp_path / "measured", tmp_path)
    figures = results_page.folder_figures(tmp_path / "others")
    assert figures["MultiArmCell-4/ecbs/solved"]["value"] == 1
    assert figures["MultiArmCell-4/ecbs/solved"]["unit"] == "of 2"
    assert figures["MultiArmCell-4/ecbs/solved"]["failed"] == {"MultiArmCell-4/1": "timeout"}
    assert figures["MultiArmCell-4/ecbs/planning_time_p90"]["value"] == 2.0


def test_a_line_replaces_its_namesake_and_yields_to_a_kept_benchmark(results_page, tmp_path):
    source = tmp_path / "measured"
    bench_folder(source / "others", [{}])
    (source / "small.jsonl").write_text('{"name": "import", "value": 2}\n{"name": "new", "value": 3}\n')
    (tmp_path / "figures.jsonl").write_text(
        '{"name": "import", "value": 1}\n{"name": "old", "value": 4}\n'
        '{"name": "MultiArmCell-4/ecbs/planning_time_median", "value": 9}\n'
        '{"name": "MultiArmCell-4/ecbs/cost_mean_beside_published", "value": 5}\n'
    )
    results_page.keep_all(source, tmp_path)
    kept = map(json.loads, (tmp_path / "figures.jsonl").read_text().splitlines())
    assert {line["name"]: line["value"] for line in kept} == {
        "import": 2,
        "old": 4,
        "MultiArmCell-4/ecbs/cost_mean_beside_published": 5,
        "new": 3,
    }


def test_no_figure_has_two_raw_values(results_page):
    lines = [json.loads(line) for line in results_page.FIGURES.read_text(encoding="utf-8").splitlines()]
    names = [line["name"] for line in lines]
    kept = [folder for folder in results_page.PLAIN if (results_page.RESULTS / folder / "results.jsonl.gz").exists()]
    of_folders = [name for folder in kept for name in results_page.folder_figures(results_page.RESULTS / folder)]
    assert len(names + of_folders) == len({*names, *of_folders})
    assert [line["name"] for line in lines if "commit" not in line] == []


def test_a_folder_without_a_report_is_refused(results_page, tmp_path):
    with pytest.raises(MmpError, match=r"has no table\.md; `mmp report"):
        results_page.keep(bench_folder(tmp_path / "cells", [{}]), tmp_path / "kept")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--count", "0"], "--count is '0'; it must be a whole number from 1"),
        (["--workers", "two"], "--workers is 'two'"),
        (["--time-limit", "1e3"], "--time-limit is '1e3'; it must be a number of seconds"),
        (["--out"], "--out needs a value"),
        (["--limit", "3"], "unknown argument '--limit'"),
        (["--quick", "--count", "0"], "--count is '0'"),
        (["--quick", "--pages"], "--pages does not go with --quick"),
        (["--instances", "none"], "--instances is 'none', which is no folder"),
    ],
)
def test_the_reproduction_refuses_bad_arguments_before_it_does_anything(words, message):
    done = checkout_scripts.run("reproduce_paper.sh", *words)
    assert (done.returncode, done.stdout) == (1, "")
    assert message in done.stderr


def test_the_reproduction_explains_its_options():
    done = checkout_scripts.run("reproduce_paper.sh", "--help")
    assert done.returncode == 0
    for option in ("--quick", "--time-limit", "--count", "--workers", "--out", "--instances", "--pages"):
        assert option in done.stdout


def test_lines_in_json_are_kept_when_all_commands_of_an_output_have_ended_well(results_page, tmp_path, capfd):
    measure = importlib.import_module("measure")
    good = [sys.executable, "-c", """print('a'); print('{"name": 1}')"""]
    with pytest.raises(MmpError, match=r"out\.jsonl ended with exit code 3"):
        measure.run([good, [sys.executable, "-c", "raise SystemExit(3)"]], tmp_path / "out.jsonl")
    assert not (tmp_path / "out.jsonl").exists()
    measure.run([good, good], tmp_path / "out.jsonl")
    assert (tmp_path / "out.jsonl").read_text() == '{"name": 1}\n' * 2
    assert capfd.readouterr().out == "a\n" * 3


def test_lines_of_another_commit_are_not_taken_for_those_of_this_one(results_page, tmp_path, monkeypatch):
    measure = importlib.import_module("measure")
    ran = []
    monkeypatch.setattr(measure, "run", lambda commands, target: ran.append(target.name))
    monkeypatch.setattr(sys, "argv", ["measure.py", "attacks", "--out", str(tmp_path)])
    monkeypatch.setattr(measure, "commit", lambda: "one")
    measure.main()
    assert "fuzz.jsonl" in ran
    (tmp_path / "fuzz.jsonl").touch()
    ran.clear()
    measure.main()
    assert "fuzz.jsonl" not in ran
    monkeypatch.setattr(measure, "commit", lambda: "other")
    with pytest.raises(MmpError, match="was begun with"):
        measure.main()


def test_every_script_that_the_measurement_runs_is_there(results_page):
    lines = importlib.import_module("benchmarks").LINES
    names = {command[0] for part in lines.values() for commands in part.values() for command in commands}
    assert [name for name in names if not (ROOT / "scripts" / name).is_file()] == []


def test_the_page_on_attacks_has_the_commands_that_the_measurement_runs(results_page):
    page = (ROOT / "docs" / "explanation" / "attacks.md").read_text(encoding="utf-8")
    for commands in importlib.import_module("benchmarks").LINES["attacks"].values():
        for command in commands:
            words = " ".join(command)
            assert f"scripts/{re.sub(' --figure [a-z_]+', '', words)}" in page


def test_all_kept_benchmarks_and_figures_of_planners_come_from_one_commit():
    kept = [path.parent for path in PAGE.parent.glob("*/results.jsonl.gz")]
    commits = {json.loads((folder / "condition.json").read_text(encoding="utf-8"))["commit"] for folder in kept}
    lines = map(json.loads, (PAGE.parent / "figures.jsonl").read_text(encoding="utf-8").splitlines())
    beyond = [line["commit"] for line in lines if line["name"].startswith(("nodes_", "waits_", "repulsion/"))]
    assert beyond
    assert len(commits | set(beyond)) == 1
    assert not commits.pop().endswith("-dirty")


@pytest.mark.parametrize("page", ["results/README.md", "explanation/paper.md", "explanation/conflict-tree-planners.md"])
def test_all_figures_quoted_on_the_pages_on_the_paper_come_from_that_commit(results_page, page):
    figures = importlib.import_module("measured").read_figures()
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    quoted = [name for words in re.findall(r"<!-- figure: (.+?) as ", text) for name in words.split(" / ")]
    commits = {figures[name.partition("#")[0]]["commit"] for name in quoted}
    assert commits == {results_page.condition(PAGE.parent / "cells")["commit"]}


FOLDERS = sorted(path.parent.name for path in PAGE.parent.glob("*/settings.json"))


def test_every_folder_that_the_script_measures_is_kept_and_no_other(results_page):
    benches = importlib.import_module("benchmarks").BENCHES
    assert sorted(folder for part in benches.values() for folder in part) == FOLDERS


@pytest.mark.parametrize("folder", FOLDERS)
def test_what_was_measured_is_what_the_script_runs(results_page, folder):
    """Cells, planners with their options, number of instances, and time limit."""
    benchmarks = importlib.import_module("benchmarks")
    (words,) = (part[folder] for part in benchmarks.BENCHES.values() if folder in part)
    of_count, of_limit = benchmarks.SHARES.get(folder, (1.0, 1.0))
    ran = json.loads((PAGE.parent / folder / "settings.json").read_text(encoding="utf-8"))
    assert [Path(source).stem for source in ran["sources"]] == words[: words.index(next(filter(is_option, words)))]
    assert ran["count"] == round(benchmarks.COUNTS.get(folder, 50) * of_count)
    assert ran["time_limit_s"] == 10 * of_limit
    assert (ran["exact"], ran["seed"]) == ("--exact" in words, 0)
    assert (ran["robot"], ran["task"]) == (value_of("--robot", words), value_of("--task", words) or task_of(words))
    parts = (part.partition("=") for part in value_of("--planners", words).split(","))
    names = {label: name or label for label, _, name in parts}
    options = {label: {} for label in names}
    for _, given in filter(lambda pair: pair[0] == "--set", pairwise(words)):
        label, _, option = given.partition("=")[0].rpartition(".")
        options[label][option] = setting(given)[1]
    assert [(planner["label"], planner["name"], planner["options"]) for planner in ran["planners"]] == [
        (label, name, options[label]) for label, name in names.items()
    ]


def task_of(words):
    """Returns the default task of the cells; files of instances have none."""
    return "reach" if words[0].startswith("MultiArmCell") else None


def is_option(word):
    return word.startswith("--")


def value_of(option, words):
    """Returns the word after an option, or None if it is not given."""
    return next((value for name, value in pairwise(words) if name == option), None)


def test_every_variant_has_options_that_its_planner_takes(results_page):
    benchmarks = importlib.import_module("benchmarks")
    tables = (benchmarks.VARIANTS, benchmarks.DECISIONS, benchmarks.TRACK, benchmarks.PRESET)
    for label, words in [item for table in tables for item in table.items()]:
        name = benchmarks.planner_of(label)
        planner = make(name, **dict(map(setting, words.split())))
        assert (planner == make(name)) == (not words), label


def test_every_variant_on_the_paper_page_is_one_that_the_script_runs(results_page):
    benchmarks, tables = importlib.import_module("benchmarks"), importlib.import_module("planner_tables")
    assert tables.OPTIONS.keys() <= benchmarks.VARIANTS.keys() | benchmarks.DECISIONS.keys()
    assert benchmarks.DECISIONS.keys() <= tables.OPTIONS.keys()


def test_the_page_adds_up_the_parts_that_the_reproduction_runs_by_default(results_page):
    text = (ROOT / "scripts" / "reproduce_paper.sh").read_text(encoding="utf-8")
    (words,) = re.findall(r"parts=\((cells [^)]*) \"\$\{beyond\[@\]\}\"\)", text)
    assert (*words.split(), "beyond") == importlib.import_module("benchmarks").REPRODUCED


def test_the_durations_of_a_part_that_went_on_add_up(results_page, tmp_path, monkeypatch):
    benchmarks, measure = importlib.import_module("benchmarks"), importlib.import_module("measure")
    clock = iter(range(0, 10**6, 900))
    monkeypatch.setattr(measure.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(measure, "run", lambda commands, target: None)
    for words in (["preset"], ["preset"], ["pages"]):
        monkeypatch.setattr(sys, "argv", ["measure.py", *words, "--workers", "2", "--out", str(tmp_path)])
        measure.main()
    (line,) = map(json.loads, (tmp_path / "durations.jsonl").read_text().splitlines())
    assert (line["name"], line["value"], line["workers"], line["count"]) == ("duration_preset", 1800, 2, 50)
    lines = [json.dumps(line | {"name": f"duration_{part}"}) for part in benchmarks.REPRODUCED]
    (tmp_path / "figures.jsonl").write_text("\n".join(lines))
    table = results_page.with_tables("<!-- table: durations -->\n<!-- end of table -->", tmp_path)
    assert "| `preset` | 30.0 min | 2 | 50 | 10 s |" in table
    assert "together took 4.5 hours" in table
