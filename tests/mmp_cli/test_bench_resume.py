"""A benchmark that was killed, interrupted or torn continues where it stopped. Other settings are refused."""

import fcntl
import json
import os
import signal
import time
from pathlib import Path

import pytest
from support import bench_runs

COUNT = 6


def until(condition):
    """Waits until another process makes the condition true. Fails after a limit."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def marks(path):
    """Returns the files that planner `slow` leaves behind: instance -> process."""
    return {file.name: int(text) for file in path.glob("pair-*") if (text := file.read_text())}


def gone(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.fixture
def held(tmp_path):
    """Starts a benchmark that waits after some results while the file `hold` exists. Yields process and arguments."""
    source = bench_runs.many_instances(tmp_path, COUNT)
    out = tmp_path / "out"
    planner = ["--planners", "slow", "--set", f"folder={tmp_path}", "--set", "takes=0.02", "--workers", 2]
    words = [source, *planner, "--out", out, "--save-plans"]
    with bench_runs.started(tmp_path, *words) as process:
        until(lambda: out.exists() and (out / "results.jsonl").exists() and bench_runs.lines(out))
        (tmp_path / "hold").touch()
        yield process, words
        process.kill()


def assert_goes_on(path, words):
    """Checks that no worker is left, and that a second start completes the results and keeps the earlier ones."""
    until(lambda: all(gone(worker) for worker in marks(path).values()))
    out = path / "out"
    before = (out / "results.jsonl").read_bytes()
    (path / "hold").unlink()
    assert bench_runs.bench(path, *words).code == 0
    assert (out / "results.jsonl").read_bytes().startswith(before)
    lines = bench_runs.lines(out)
    assert sorted(line["instance"] for line in lines) == [f"pair/turn{k}" for k in range(COUNT)]
    assert {line["status"] for line in lines} == {"solved"}
    assert all((out / line["plan"]).is_file() for line in lines)


def test_a_folder_that_holds_anything_else_is_refused_and_stays_as_it_is(tmp_path):
    source, out = bench_runs.instances(tmp_path), tmp_path / "thesis"
    out.mkdir()
    (out / "chapter.tex").write_text("mine")
    ran = bench_runs.bench(tmp_path, source, "--planners", "quick", "--out", out)
    assert ran.code == 2
    assert f"{out} is no benchmark folder and is not empty: chapter.tex is in it" in ran.err
    assert os.listdir(out) == ["chapter.tex"]


def test_a_folder_of_a_run_that_was_ended_at_its_very_beginning_is_taken(tmp_path):
    source, out = bench_runs.instances(tmp_path), tmp_path / "out"
    out.mkdir()
    for name in ("results.jsonl", ".mmp-1-ab.tmp"):
        (out / name).touch()
    assert bench_runs.bench(tmp_path, source, "--planners", "quick", "--workers", 1, "--out", out).code == 0


def test_a_killed_benchmark_leaves_no_process_and_continues(held, tmp_path):
    process, words = held
    until(lambda: len(marks(tmp_path)) > len(bench_runs.lines(tmp_path / "out")))
    process.kill()
    process.wait()
    assert_goes_on(tmp_path, words)


def test_ctrl_c_ends_it_promptly_with_130_and_keeps_what_is_there(held, tmp_path):
    process, words = held
    until(lambda: len(marks(tmp_path)) > len(bench_runs.lines(tmp_path / "out")))
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.endswith("mmp: interrupted\n")
    assert_goes_on(tmp_path, words)


def test_a_killed_worker_costs_one_line_and_the_rest_runs(held, tmp_path):
    process, _ = held
    out = tmp_path / "out"
    until(lambda: len(marks(tmp_path)) > len(bench_runs.lines(out)))
    done = {line["instance"].replace("/", "-") for line in bench_runs.lines(out)}
    name, worker = next((name, pid) for name, pid in marks(tmp_path).items() if name.rpartition(".")[0] not in done)
    os.kill(worker, signal.SIGKILL)
    (tmp_path / "hold").unlink()
    process.communicate(timeout=60)
    assert process.returncode == 0
    lines = {line["instance"].replace("/", "-"): line for line in bench_runs.lines(out)}
    assert len(lines) == COUNT
    killed = lines.pop(name.rpartition(".")[0])
    assert (killed["status"], killed["planner"]) == ("error", "slow")
    assert "killed by SIGKILL" in killed["message"]
    assert {line["status"] for line in lines.values()} == {"solved"}


def test_a_second_start_of_a_complete_benchmark_only_prints_the_summary(copied):
    out, _, again = copied
    before = (out / "results.jsonl").read_bytes()
    ran = again()
    assert ran.code == 0
    assert "3 of 3" in ran.out
    assert (out / "results.jsonl").read_bytes() == before


def test_workers_and_the_order_of_options_make_no_difference(copied, tmp_path, monkeypatch):
    out, source, _ = copied
    before = (out / "results.jsonl").read_bytes()
    monkeypatch.chdir(source.parent)
    words = ["--seed", 4, "--set", "other.steps=5", "--planners", "other=quick,quick", "--set", "w=2", "--workers", 7]
    assert bench_runs.bench(tmp_path, source.name, *words, "--out", out).code == 0
    assert (out / "results.jsonl").read_bytes() == before


@pytest.mark.parametrize("cut", [1, 40, 10**6])
def test_a_torn_last_line_is_cut_off_and_done_again(copied, cut):
    out, _, again = copied
    *whole, last = (out / "results.jsonl").read_bytes().splitlines(keepends=True)
    torn = last[: -min(cut, len(last) - 1)]
    (out / "results.jsonl").write_bytes(b"".join(whole) + torn)
    assert again().code == 0
    lines = bench_runs.lines(out)
    assert len({(line["instance"], line["planner"]) for line in lines}) == len(lines) == 6
    assert (out / "results.jsonl").read_bytes().startswith(b"".join(whole))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--time-limit", 5], ["time_limit_s is 60.0 there and 5.0 here"]),
        (["--seed", 5], ["seed is 4 there and 5 here"]),
        (["--margin", "0.001"], ["margin is null there and"]),
        (["--save-plans", "--exact"], ["save_plans is false there and true here", "exact is false"]),
        (["--memory-limit", 100], ["memory_limit_mb is 4096 there and 100 here"]),
        (["--planners", "quick,other=helpless"], ["other=quick there", "other=helpless here"]),
        (["--set", "quick.steps=6"], ["options of quick are w=2 there and w=2, steps=6 here"]),
    ],
    ids=lambda value: str(value[0])[:30],
)
def test_other_settings_are_refused_with_what_differs_and_how(copied, more, words):
    out, _, again = copied
    before = (out / "results.jsonl").read_bytes()
    ran = again(*more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    for word in [str(out), "other settings", *words]:
        assert word in ran.err
    assert (out / "results.jsonl").read_bytes() == before


def test_another_version_is_another_setting(copied, tmp_path, monkeypatch):
    out, _, again = copied
    settings = json.loads((out / "settings.json").read_text())
    (out / "settings.json").write_text(json.dumps(settings | {"version": "0.0.1"}))
    assert "version is '0.0.1' there" in again().err


@pytest.mark.parametrize("key", ["digests", "names", "hashes"])
def test_settings_with_another_number_of_entries_than_sources_are_refused(copied, key):
    out, _, again = copied
    settings = json.loads((out / "settings.json").read_text())
    (out / "settings.json").write_text(json.dumps(settings | {key: settings[key] * 2}))
    ran = again()
    assert ran.code == 2
    assert f"settings.json: {key} has 2 entries; it must have 1, as 'sources' has" in ran.err


def test_a_second_benchmark_in_the_same_folder_is_refused(copied):
    out, _, again = copied
    with (out / "results.jsonl").open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        ran = again()
    assert ran.code == 2
    assert "in use by another mmp bench" in ran.err
    assert again().code == 0


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (b"{}", ["line 7", "not a result of this benchmark"]),
        (b"[1]", ["line 7", "not a result of this benchmark"]),
        (b"torn in the middle", ["line 7 is not JSON"]),
        (b"\xff\xfe", ["line 7 is not text in UTF-8"]),
        (b'{"instance": "pair/x", "planner": "quick", "seed": 4, "status": "solved"}', ["line 7", "not a result of"]),
        (b'{"instance": "pair/turn0", "planner": "quick", "seed": 4, "status": "won"}', ["line 7", "not a result of"]),
        (b'{"instance": "pair/turn0", "planner": "quick", "seed": 4, "status": "error"}', ["line 7", "second time"]),
    ],
)
def test_lines_from_elsewhere_are_refused(copied, row, words):
    out, _, again = copied
    with (out / "results.jsonl").open("ab") as file:
        file.write(row + b"\n")
    before = (out / "results.jsonl").read_bytes()
    ran = again()
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    for word in [str(out / "results.jsonl"), *words]:
        assert word in ran.err
    assert (out / "results.jsonl").read_bytes() == before


def test_blank_lines_are_skipped_as_in_a_report(copied, mmp, figures_unrendered):
    out, _, again = copied
    rows = (out / "results.jsonl").read_text().splitlines(keepends=True)
    (out / "results.jsonl").write_text("".join(["\n", *rows[:2], " \t\r\n", "\u00a0\n", *rows[2:], "\n", "\n"]))
    before = (out / "results.jsonl").read_bytes()
    ran = again()
    assert (ran.code, ran.err) == (0, "")
    assert (out / "results.jsonl").read_bytes() == before
    assert mmp("report", out).code == 0
    with (out / "results.jsonl").open("a") as file:
        file.write("{}\n")
    assert "line 12 is not a result of this benchmark" in again().err


def test_results_without_settings_are_not_taken_over(copied):
    out, _, again = copied
    (out / "settings.json").unlink()
    ran = again()
    assert ran.code == 2
    assert "without its settings.json" in ran.err


@pytest.mark.parametrize("content", ["", "[]", '{"schema": "mmp-plan/1"}', '{"schema": "mmp-bench/1"}'])
def test_malformed_settings_are_refused(copied, content):
    out, _, again = copied
    (out / "settings.json").write_text(content)
    ran = again()
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert str(out) in ran.err
