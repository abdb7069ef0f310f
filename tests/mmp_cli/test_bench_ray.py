"""The same units on a Ray cluster, which the tests start like `ray start --head` and stop at their end."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import pytest
from support import bench_runs

NOT_COMPARED = ("planning_time_s", "check_time_s", "machine", "workers", "load")
START = [sys.executable, "-m", "ray.scripts.scripts", "start", "--head", "--block", "--num-cpus=2"]
LEAN = ["--include-dashboard=false", "--disable-usage-stats", "--object-store-memory=80000000"]


def answers(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
        return True
    return False


@pytest.fixture
def cluster(tmp_path):
    """Yields the address of a cluster of one machine with two cores, which finds the installed test planners."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    folder = tempfile.mkdtemp(prefix="ray-")  # a short path, because paths of sockets have a limit
    command = [*START, f"--port={port}", f"--temp-dir={folder}", "--min-worker-port=0", "--max-worker-port=0", *LEAN]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "stdin": subprocess.DEVNULL}
    process = subprocess.Popen(command, env=bench_runs.environment(tmp_path), process_group=0, **quiet)
    try:
        end = time.monotonic() + 120
        while not answers(port):
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.1)
        yield f"127.0.0.1:{port}"
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(30)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        shutil.rmtree(folder, ignore_errors=True)


def compared(out):
    lines = [{key: line[key] for key in line if key not in NOT_COMPARED} for line in bench_runs.lines(out)]
    return sorted(lines, key=lambda line: (line["instance"], line["planner"]))


def test_a_cluster_goes_on_where_this_machine_stopped_with_the_same_results(cluster, tmp_path):
    words = ["MultiArmCell-2", "--planners", "ecbs,rogue,absent", "--set", "rogue.deed=crash", "--count", 2]
    here, there = tmp_path / "here", tmp_path / "there"
    assert bench_runs.bench(tmp_path, *words, "--save-plans", "--out", here).code == 0
    there.mkdir()
    shutil.copy(here / "settings.json", there)
    before = b"".join((here / "results.jsonl").read_bytes().splitlines(keepends=True)[:1])
    (there / "results.jsonl").write_bytes(before)
    with bench_runs.started(tmp_path, *words, "--save-plans", "--out", there, "--ray", cluster) as process:
        out, err = process.communicate()
    assert process.returncode == 0, err
    assert "1 results are there, 5 to come" in err
    assert "2 of 2" in out
    assert (there / "results.jsonl").read_bytes().startswith(before)
    assert compared(there) == compared(here)
    assert {line["status"] for line in compared(there)} == {"solved", "error"}
    for plan in (there / "plans").rglob("*.json"):
        assert plan.read_bytes() == (here / plan.relative_to(there)).read_bytes()


def test_without_ray_one_sentence_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    ran = bench_runs.bench(tmp_path, "MultiArmCell-2", "--planners", "quick", "--ray", "auto", "--out", tmp_path / "o")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "mmp: --ray needs the package Ray; get it with: pip install 'mmp-env[ray]'\n"
    assert not (tmp_path / "o").exists()


def test_an_address_without_a_cluster_is_named(tmp_path):
    words = ["MultiArmCell-2", "--planners", "quick", "--ray", "127.0.0.1:1", "--out", tmp_path / "o"]
    with bench_runs.started(tmp_path, *words) as process:
        _, err = process.communicate()
    assert process.returncode == 2
    assert err.startswith("mmp: the Ray cluster at 127.0.0.1:1 cannot be reached: ")
    assert err.count("\n") == 1
