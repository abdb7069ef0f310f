"""Runs of `mmp bench` in tests, with the test planners installed, and their results."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from support import bad_files, bench_stand_ins

from mmp_cli.main import main

TESTS = Path(__file__).parents[1]
_PROGRAM = "from mmp_cli.main import main; raise SystemExit(main())"


class Ran(NamedTuple):
    """The result of a command line."""

    code: int
    out: str
    err: str


def bench(path: Path, *argv: Any) -> Ran:
    """Runs `mmp bench` in this process; `path` is the folder of the test planners."""
    with pytest.MonkeyPatch.context() as patch, io.StringIO() as out, io.StringIO() as err:
        patch.syspath_prepend(site(path))
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(["bench", *map(str, argv)])
        return Ran(code, out.getvalue(), err.getvalue())


def started(path: Path, *argv: Any) -> subprocess.Popen[str]:
    """Starts `mmp bench` as another process, which tests can interrupt and kill."""
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, "bench", *map(str, argv)],
        env=environment(path),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def environment(path: Path) -> dict[str, str]:
    """Returns the environment variables of a process that finds the test planners."""
    folders = [str(site(path)), str(TESTS), os.environ.get("PYTHONPATH")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, folders))}


def lines(out: Path) -> list[dict[str, Any]]:
    """Returns the lines of results.jsonl in a folder."""
    return [json.loads(row) for row in (out / "results.jsonl").read_text().splitlines()]


def instances(path: Path) -> Path:
    """Returns an instance file with a solvable instance, `turn`, and an invalid one, `outside`."""
    file = path / "pairs.json"
    file.write_text(json.dumps(bad_files.good_instances()))
    return file


def many_instances(path: Path, count: int) -> Path:
    """Returns an instance file with `count` solvable instances."""
    data = bad_files.good_instances()
    turn = data["instances"][0]
    data["instances"] = [turn | {"name": f"turn{k}"} for k in range(count)]
    file = path / "many.json"
    file.write_text(json.dumps(data))
    return file


def cell(name: str) -> dict[str, Any]:
    """Returns the data of a valid cell with that name."""
    return bad_files.good_cell() | {"name": name}


def site(path: Path) -> Path:
    """Returns the folder below `path` in which the test planners are installed."""
    folder = path / "site"
    if not folder.exists():
        folder.mkdir()
        bench_stand_ins.install(folder)
    return folder
