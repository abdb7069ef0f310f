"""Every option that takes a path answers a path that the system refuses with one sentence, exit 2 and no file."""

import errno
import json
import os
from pathlib import Path

import pytest
from support import bad_files
from support.refusals import assert_refused

from mmp_cli.reporting.folder import write_files

ENDS = json.dumps({"left": bad_files.TUCKED, "right": bad_files.TUCKED})
LONG, NUL = "a" * 300, "a\0b"

READS = {
    "plan SOURCE": lambda path, given: ["plan", path],
    "plan --start": lambda path, given: ["plan", given["cell"], "--start", f"@{path}", "--goal", ENDS],
    "plan --goal": lambda path, given: ["plan", given["cell"], "--start", ENDS, "--goal", f"@{path}"],
    "bench SOURCE": lambda path, given: ["bench", path, "--out", given["new"]],
    "check": lambda path, given: ["check", path],
    "export": lambda path, given: ["export", path, "--to", given["new"] + ".csv"],
    "show": lambda path, given: ["show", path],
    "show --image": lambda path, given: ["show", path, "--image", given["new"] + ".png"],
    "report": lambda path, given: ["report", path],
}
"""Option -> a command line that reads `path` with it; `given` are paths of good files."""

WRITES = {
    "plan --out": lambda path, given: ["plan", given["instances"], "--planner", "straight", "--out", path],
    "plan --tree": lambda path, given: ["plan", given["instances"], "--planner", "straight", "--tree", path + ".svg"],
    "plan --rerun": lambda path, given: ["plan", given["instances"], "--planner", "straight", "--rerun", path + ".rrd"],
    "plan --image": lambda path, given: ["plan", given["instances"], "--planner", "straight", "--image", path + ".png"],
    "plan --video": lambda path, given: ["plan", given["instances"], "--planner", "straight", "--video", path + ".gif"],
    "show --image": lambda path, given: ["show", given["plan"], "--image", path + ".png"],
    "show --video": lambda path, given: ["show", given["plan"], "--video", path + ".gif"],
    "show --rerun": lambda path, given: ["show", given["plan"], "--rerun", path + ".rrd"],
    "export --to": lambda path, given: ["export", given["plan"], "--to", path + ".csv"],
    "bench --out": lambda path, given: ["bench", given["instances"], "--out", path],
}
"""Option -> a command line that writes to `path` with it."""


@pytest.fixture
def given(tmp_path, cell, instances, plan):
    return {"cell": str(cell), "instances": str(instances), "plan": str(plan), "new": str(tmp_path / "new")}


@pytest.fixture
def locked(tmp_path, monkeypatch):
    """Returns a folder that `os.stat` refuses. Permissions would not do: the tests may run as root."""
    folder = tmp_path / "locked"
    folder.mkdir()
    for name in ("stat", "lstat", "open", "mkdir"):
        ask = getattr(os, name)

        def refuse(path, *args, _ask=ask, **options):
            if isinstance(path, str | Path) and str(path).startswith(f"{folder}/"):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), os.fspath(path))
            return _ask(path, *args, **options)

        monkeypatch.setattr(os, name, refuse)
    return folder


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """Changes into a working directory and deletes it."""
    monkeypatch.chdir(tmp_path)
    here = tmp_path / "gone"
    here.mkdir()
    os.chdir(here)
    here.rmdir()


@pytest.mark.parametrize("path", [LONG, NUL, LONG + ".json", os.fsdecode(b"caf\xe9"), "/dev/null/x"], ids=ascii)
@pytest.mark.parametrize("option", READS)
def test_an_impossible_path_cannot_be_read(mmp, given, option, path):
    assert_refused(mmp(*READS[option](path, given)))
    assert not Path(given["new"]).exists()


@pytest.mark.parametrize("name", ["file.json", "folder"])
@pytest.mark.parametrize("option", READS)
def test_a_path_without_permission_is_named_with_the_reason(mmp, given, locked, option, name):
    assert_refused(mmp(*READS[option](str(locked / name), given)), "Permission denied", str(locked / name))


@pytest.mark.parametrize("option", READS)
def test_nothing_can_be_read_in_a_folder_that_is_gone(mmp, given, nowhere, option):
    for path in ("file.json", "."):
        assert_refused(mmp(*READS[option](path, given)))


@pytest.mark.parametrize("path", [LONG, NUL], ids=ascii)
@pytest.mark.parametrize("option", WRITES)
def test_a_file_of_an_impossible_name_is_refused_before_anything_is_planned(mmp, stand_ins, given, option, path):
    assert_refused(mmp(*WRITES[option](path, given)), "cannot be")
    assert stand_ins.Straight.calls == []


@pytest.mark.parametrize("end", ["/", "/."])
@pytest.mark.parametrize("option", sorted(WRITES.keys() - {"bench --out"}))
def test_a_file_that_ends_in_a_slash_is_refused_before_anything_is_planned(mmp, stand_ins, given, option, end):
    *words, path = WRITES[option](given["new"], given)
    assert_refused(mmp(*words, path + end), "it ends like the path of a folder; give the name of a file")
    assert stand_ins.Straight.calls == []
    assert not Path(path).exists()


@pytest.mark.parametrize("option", WRITES)
def test_a_file_where_nothing_may_be_written_is_refused_before_anything_is_planned(
    mmp, stand_ins, given, locked, option
):
    assert_refused(mmp(*WRITES[option](str(locked / "new"), given)), "Permission denied")
    assert stand_ins.Straight.calls == []


@pytest.mark.parametrize("option", WRITES)
def test_a_file_in_a_folder_that_is_gone_is_refused_before_anything_is_planned(mmp, stand_ins, given, nowhere, option):
    assert_refused(mmp(*WRITES[option]("new", given)), "the working directory was deleted")
    assert stand_ins.Straight.calls == []


def test_a_page_that_names_a_folder_whose_name_is_not_utf_8_can_be_written(tmp_path):
    write_files(tmp_path, {"page.html": "the folder " + os.fsdecode(b"caf\xe9")})
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "the folder caf\\udce9"
