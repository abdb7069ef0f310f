"""`mmp plan` prints its result even if the disk takes only a kilobyte of each file."""

import json
import os
import subprocess
import sys

import pytest

from mmp_env.errors import MmpError
from mmp_env.opengl import offscreen_backend

MMP = 'ulimit -f 1; exec "$0" -c \'from mmp_cli.main import main; raise SystemExit(main())\' "$@"'
FULL = "cannot be written: File too large"


@pytest.fixture
def planned(instances, tmp_path):
    def run(*options):
        words = ["bash", "-c", MMP, sys.executable, "plan", str(instances), "--planner", "ecbs", *options]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)

    return run


@pytest.fixture
def needs_pictures():
    pytest.importorskip("rerun")
    try:
        offscreen_backend()
    except MmpError as error:
        pytest.skip(str(error))


def test_the_summary_of_a_plan_that_does_not_fit_is_printed(planned, instances, tmp_path):
    ran = planned("--out", "plan.json", "--execute")
    assert (ran.returncode, ran.stderr) == (2, f"mmp: --out: plan.json {FULL}\n")
    for words in ("status     solved", "check      valid", "every goal reached"):
        assert words in ran.stdout
    assert "plan file" not in ran.stdout
    assert os.listdir(tmp_path) == [instances.name]


def test_every_file_that_does_not_fit_is_a_sentence_and_the_result_is_printed(
    planned, instances, tmp_path, needs_pictures
):
    files = {"out": "plan.json", "tree": "t.svg", "rerun": "r.rrd", "image": "p.png", "video": "v.gif"}
    options = [word for name, file in files.items() for word in (f"--{name}", file)]
    ran = planned(*options, "--json")
    assert ran.returncode == 2
    printed = [line for line in ran.stderr.splitlines() if line.startswith("mmp: ")]
    assert printed == [f"mmp: --{name}: {file} {FULL}" for name, file in files.items()]
    assert "Traceback" not in ran.stderr
    result = json.loads(ran.stdout)
    assert (result["status"], result["valid"], result["plan"]) == ("solved", True, None)
    assert os.listdir(tmp_path) == [instances.name]
