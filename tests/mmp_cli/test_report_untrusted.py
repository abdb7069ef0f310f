"""`mmp report` and `mmp bench` on malicious folders: nothing hangs, and no other file is disclosed."""

import json
import os

import pytest
from support.refusals import assert_refused
from support.report_folders import folder_of, line, settings

from mmp_cli.benchmark.folder import ResultsFolder
from mmp_env.errors import MmpError

pytestmark = pytest.mark.usefixtures("figures_unrendered")

KEY = ("ring/0", "a", 0)
ABSURD = [
    ("cost_rad", "x", "cost_rad is 'x'; it must be a number"),
    ("makespan_s", 1e308, "makespan_s is 1e+308; it must be a finite number from 0 to 1e+12"),
    ("planning_time_s", float("inf"), "planning_time_s is inf"),
    ("check_time_s", [1], "check_time_s is [1]"),
    ("expanded_nodes", 1e13, "expanded_nodes is 1"),
    ("fast_track_tries", True, "fast_track_tries is true"),
    ("root_conflicts", -1, "root_conflicts is -1"),
    ("min_clearance_m", -1e300, "min_clearance_m is -1e+300; it must be a finite number from -1e+12"),
    ("margins_proved", {"arms": "x"}, "margins_proved.arms is 'x'; it must be a number"),
    ("margins_asked", {"self": 1e300}, "margins_asked.self is 1e+300; it must be a finite number from -1e+12"),
    ("cost_lower_bound_rad", {}, "cost_lower_bound_rad is {}"),
    ("arms", -4, "arms is -4; it must be a whole number from 1"),
    ("arms", 10**300, "arms is "),
    ("bound_met", 1, "bound_met is 1; it must be true or false"),
    ("message", ["x"], "message is ['x']; it must be text"),
    ("machine", "x" * 20_000, "it must be at most 10000 characters"),
]


@pytest.mark.parametrize(("field", "value", "words"), ABSURD)
def test_a_line_of_wrong_types_or_numbers_is_named_with_its_field(mmp, tmp_path, field, value, words):
    lines = [line("ring/1", "a"), line("ring/0", "a", **{field: value})]
    folder = folder_of(tmp_path, lines, settings("a"))
    assert_refused(mmp("report", folder), f"{folder / 'results.jsonl'} line 2: ", words)
    bench = ResultsFolder(folder, settings("a") | {"digests": [], "names": [], "hashes": []}, {KEY, ("ring/1", "a", 1)})
    with pytest.raises(MmpError) as refusal, bench:
        pass
    assert f"{folder / 'results.jsonl'} line 2: " in str(refusal.value)
    assert words in str(refusal.value)


def test_the_least_and_largest_numbers_make_a_report(mmp, tmp_path):
    numbers = dict.fromkeys(("planning_time_s", "cost_rad", "makespan_s", "expanded_nodes", "root_conflicts"))
    lines = [
        line(f"ring/{k}", planner, cost_lower_bound_rad=5e-324, **dict.fromkeys(numbers, value))
        for k, value in enumerate((0, 5e-324, 1.0, 1e12))
        for planner in ("a", "b")
    ]
    assert mmp("report", folder_of(tmp_path, lines, settings("a", "b"))).code == 0


@pytest.mark.parametrize("name", ["results.jsonl", "settings.json"])
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_only_regular_files_are_read(mmp, tmp_path, name, kind):
    folder = folder_of(tmp_path / "results", [line("ring/0", "a")], settings("a"))
    (folder / name).unlink()
    {"pipe": os.mkfifo, "device": lambda path: path.symlink_to("/dev/zero"), "folder": os.mkdir}[kind](folder / name)
    assert_refused(mmp("report", folder), f"{folder / name} cannot be read")
    with (
        pytest.raises(MmpError, match="cannot be"),
        ResultsFolder(folder, settings("a") | {"digests": [], "names": [], "hashes": []}, {KEY}),
    ):
        pass


def test_a_file_of_results_that_is_too_large_is_not_read(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", "a")], settings("a"))
    os.truncate(folder / "results.jsonl", 2**28 + 1)
    assert_refused(mmp("report", folder), "results.jsonl is larger than 256 MB")
    bench = ResultsFolder(folder, settings("a") | {"digests": [], "names": [], "hashes": []}, {KEY})
    with pytest.raises(MmpError, match="is larger than 256 MB"), bench:
        pass


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"count": 100_000_000}, "settings.json: count is 100000000; it must be a number from 1 to 250000"),
        ({"count": 200_000}, "settings.json: count makes 400000 units; a benchmark has at most 250000"),
        ({"count": -1}, "settings.json: count is -1"),
        ({"seed": -1}, "settings.json: seed is -1"),
        ({"time_limit_s": 1e300}, "settings.json: time_limit_s is 1e+300"),
        ({"time_limit_s": float("nan")}, "settings.json: time_limit_s is nan"),
        ({"margin": 1e300}, "settings.json: margin between arms is 1e+300"),
        ({"memory_limit_mb": -5}, "settings.json: memory_limit_mb is -5"),
        ({"sources": ["ring"] * 1001}, "settings.json: sources has 1001 entries"),
    ],
)
def test_numbers_of_the_settings_that_no_benchmark_has_are_refused(mmp, tmp_path, more, words):
    folder = folder_of(tmp_path, [line("ring/0", "a")], settings("a", "b") | more)
    assert_refused(mmp("report", folder), words)


def test_a_benchmark_whose_results_would_be_unreadable_does_not_begin(mmp, tmp_path):
    ran = mmp("bench", "MultiArmCell-2", "--planners", "ecbs", "--count", 10**8, "--out", tmp_path / "results")
    assert_refused(ran, "--count 100000000 makes 100000000 units; a benchmark has at most 250000")
    assert not (tmp_path / "results").exists()


def test_more_planners_than_a_report_can_show_are_a_sentence(mmp, tmp_path):
    folder = folder_of(tmp_path, [line("ring/0", f"p{k}") for k in range(101)])
    assert_refused(mmp("report", folder), "has results of 101 planners; a report shows at most 100")


@pytest.mark.parametrize("where", ["elsewhere", "beside"])
def test_no_file_that_the_settings_name_is_disclosed(mmp, tmp_path, monkeypatch, where):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    secret = tmp_path / ("private.json" if where == "elsewhere" else "here/private.json")
    secret.write_text(json.dumps({"arms": [], "password <b>1234": "hunter2"}))
    read = []
    monkeypatch.setattr("mmp_cli.reporting.settings.read_document", lambda path: read.append(str(path)) or real(path))
    folder = folder_of(tmp_path / "here" / "results", [line("ring/0", "a")], settings("a", sources=[str(secret)]))
    ran = mmp("report", folder)
    assert ran.code == 0
    texts = (folder / "report.html").read_text() + (folder / "table.md").read_text() + ran.out + ran.err
    assert "No pictures of private.json" in texts
    for word in ("password", "hunter2", str(tmp_path / "private")):
        assert word not in texts
    assert (str(secret) in read) == (where == "beside")


def real(path):
    from mmp_env.files.reading import read_document

    return read_document(path)
