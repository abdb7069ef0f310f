"""A complete benchmark gets further planners, sources and instances, and keeps its results."""

import json

import pytest
from support import bench_runs

from mmp_cli.benchmark.known_sources import KnownSource
from mmp_cli.benchmark.settings import larger_count
from mmp_env import find_cell
from mmp_env.files.cell_file import cell_to_dict


def test_more_planners_sources_and_instances_are_added_and_the_old_results_kept(copied, tmp_path):
    out, source, _ = copied
    before = (out / "results.jsonl").read_bytes()
    words = ["--seed", 4, "--set", "quick.w=2", "--out", out]
    assert (
        bench_runs.bench(tmp_path, "MultiArmCell-2", "--planners", "quick,third=quick", "--count", 2, *words).code == 0
    )
    after = (out / "results.jsonl").read_bytes()
    assert after.startswith(before)
    assert len(after.splitlines()) == len(before.splitlines()) + 4
    settings = json.loads((out / "settings.json").read_text())
    assert settings["sources"] == [str(source), "MultiArmCell-2"]
    assert [planner["label"] for planner in settings["planners"]] == ["quick", "other", "third"]
    assert bench_runs.bench(tmp_path, "MultiArmCell-2", "--planners", "quick", "--count", 3, *words).code == 0
    assert (out / "results.jsonl").read_bytes().startswith(after)
    assert len((out / "results.jsonl").read_bytes().splitlines()) == len(after.splitlines()) + 1


@pytest.mark.parametrize(
    ("number", "change"),
    [
        (1, {"seed": 77}),
        (1, {"instance": "pair/turn7"}),
        (1, {"planner": "fourth"}),
        (7, {"seed": 5}),
        (7, {"seed": 77, "instance": "MultiArmCell-2/77"}),
        (7, {"seed": 77, "instance": "MultiArmCell-4/4"}),
    ],
    ids=str,
)
def test_a_line_of_no_unit_of_any_start_is_refused_by_each_of_them(
    copied, tmp_path, mmp, figures_unrendered, number, change
):
    out, _, again = copied
    words = ["--planners", "quick", "--set", "quick.w=2", "--seed", 4, "--workers", 1, "--out", out]
    assert bench_runs.bench(tmp_path, "MultiArmCell-2", "--count", 2, *words).code == 0
    assert "not a result of this benchmark" not in mmp("report", out).err
    lines = bench_runs.lines(out)
    lines[number - 1] |= change
    (out / "results.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    before = (out / "results.jsonl").read_bytes()
    for ran in (again(), bench_runs.bench(tmp_path, "MultiArmCell-2", "--count", 2, *words)):
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert f"line {number} is not a result of this benchmark" in ran.err
        assert (out / "results.jsonl").read_bytes() == before
    assert f"Line {number} of the results is not a result of this benchmark" in mmp("report", out).err


def test_settings_of_an_earlier_version_do_not_tell_its_instances(copied, tmp_path):
    out, _, _ = copied
    settings = json.loads((out / "settings.json").read_text())
    for key in ("digests", "names", "hashes"):
        del settings[key]
    (out / "settings.json").write_text(json.dumps(settings))
    before = (out / "results.jsonl").read_bytes()
    words = ["--planners", "quick", "--set", "quick.w=2", "--seed", 4, "--count", 1, "--out", out]
    assert bench_runs.bench(tmp_path, "MultiArmCell-2", *words).code == 0
    assert (out / "results.jsonl").read_bytes().startswith(before)


def changed_copy(path, source):
    """Returns another file with the same names of cell and instances, but another content."""
    data = json.loads(source.read_text())
    data["instances"][1]["goal"]["left"][0] += 0.01
    (path / "elsewhere.json").write_text(json.dumps(data))
    return path / "elsewhere.json"


def test_instances_of_another_cell_or_file_with_the_same_names_are_refused(copied, tmp_path):
    out, source, _ = copied
    before = {file.name: file.read_bytes() for file in out.iterdir()}
    (tmp_path / "cell.json").write_text(json.dumps(bench_runs.cell("pair")))
    for words in ([changed_copy(tmp_path, source)], [tmp_path / "cell.json", "--count", 1]):
        ran = bench_runs.bench(tmp_path, *words, "--planners", "quick", "--set", "w=2", "--seed", 4, "--out", out)
        assert ran.code == 2
        assert f"{out} already has instances 'pair/" in ran.err
        assert {file.name: file.read_bytes() for file in out.iterdir()} == before


def test_the_same_cell_by_another_name_is_another_source(tmp_path):
    words = ["--planners", "quick", "--count", 2, "--out", tmp_path / "out"]
    file = tmp_path / "ring.json"
    file.write_text(json.dumps(cell_to_dict(find_cell("ring-2"))))
    for source in ("MultiArmCell-2", file, "MultiArmCell-2", file):
        assert bench_runs.bench(tmp_path, source, *words).code == 0
    settings = json.loads((tmp_path / "out" / "settings.json").read_text())
    assert settings["sources"] == ["MultiArmCell-2", str(file)]
    assert settings["names"] == [["MultiArmCell-2/"], ["ring-2/"]]
    assert len(bench_runs.lines(tmp_path / "out")) == 4


def test_more_units_than_a_benchmark_may_have_are_refused_before_anything_is_written(tmp_path):
    out = tmp_path / "out"
    assert bench_runs.bench(tmp_path, "MultiArmCell-2", "--planners", "quick", "--count", 1, "--out", out).code == 0
    before = (out / "settings.json").read_bytes()
    ran = bench_runs.bench(tmp_path, "MultiArmCell-2", "--planners", "third=quick", "--count", 200_000, "--out", out)
    assert ran.code == 2
    assert f"with what is in {out}, this makes 400000 units" in ran.err
    assert (out / "settings.json").read_bytes() == before


@pytest.mark.parametrize(
    ("there", "known", "here", "own", "larger"),
    [
        (None, ["ring-2/"], None, ["ring-2/"], None),
        (60, ["ring-2/"], None, ["ring-2/"], 60),
        (None, ["ring-2/"], 40, ["ring-2/"], 50),
        (None, ["pair/a", "pair/b"], 3, ["pair/a", "pair/b", "pair/c", "pair/d"], 3),
        (None, ["pair/a", "pair/b"], 1, ["pair/a", "pair/b", "pair/c", "pair/d"], 2),
        (1, ["pair/a"], None, ["pair/a", "pair/b"], 2),
        (3, [], 5, [], 5),
    ],
)
def test_the_larger_count_stays_also_if_one_of_two_starts_gives_none(there, known, here, own, larger):
    known, own = ([KnownSource("source", "digest", names, [])] for names in (known, own))
    assert larger_count(there, here, known, own) == larger


def test_a_file_of_instances_may_grow_and_the_former_file_still_continues_the_folder(tmp_path):
    source, longer = bench_runs.many_instances(tmp_path, 2), tmp_path / "longer.json"
    words = ["--planners", "quick", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, source, *words).code == 0
    before = bench_runs.lines(tmp_path / "out")
    data = json.loads(source.read_text())
    data["instances"].append(data["instances"][0] | {"name": "added"})
    longer.write_text(json.dumps(data))
    for file in (longer, source, longer):
        assert bench_runs.bench(tmp_path, file, *words).code == 0
        lines = bench_runs.lines(tmp_path / "out")
        assert lines[:2] == before
        assert [line["instance"].split("/")[1] for line in lines[2:]] == ["added"]
    settings = json.loads((tmp_path / "out" / "settings.json").read_text())
    assert settings["sources"] == [str(longer)]
    assert [len(settings[key][0]) for key in ("names", "hashes")] == [3, 3]
    assert bench_runs.bench(tmp_path, source, longer, *words).code == 2


def test_an_instance_that_changed_before_the_added_ones_is_noticed(tmp_path):
    source = bench_runs.many_instances(tmp_path, 2)
    words = [source, "--planners", "quick", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, *words).code == 0
    data = json.loads(source.read_text())
    data["instances"].insert(0, data["instances"][0] | {"name": "added"})
    source.write_text(json.dumps(data))
    ran = bench_runs.bench(tmp_path, *words)
    assert ran.code == 2
    assert f"the instances of {source} are not what they were" in ran.err


def test_a_source_that_has_changed_meanwhile_is_noticed(tmp_path):
    source = bench_runs.many_instances(tmp_path, 2)
    words = [source, "--planners", "quick", "--out", tmp_path / "out"]
    assert bench_runs.bench(tmp_path, *words).code == 0
    data = json.loads(source.read_text())
    data["instances"][1]["goal"]["left"][0] += 0.01
    source.write_text(json.dumps(data))
    ran = bench_runs.bench(tmp_path, *words)
    assert ran.code == 2
    assert f"the instances of {source} are not what they were" in ran.err
