import json
import os
import stat
import tempfile
from pathlib import Path

import numpy as np
import pytest

from mmp_env.errors import MmpError
from mmp_env.files.writing import check_writable, json_text, plain, whole_file, write_text

_NOBODY = 65534


def test_short_things_and_rows_of_numbers_stand_on_one_line():
    rows = [[k / 7 for k in range(20)] for _ in range(3)]
    text = json_text({"name": "a", "rows": rows, "empty": [], "none": {}})
    assert json.loads(text) == {"name": "a", "rows": rows, "empty": [], "none": {}}
    assert len(text.splitlines()) == 10


def test_numbers_of_numpy_are_written_as_numbers_and_those_not_finite_as_null():
    values = {"a": np.float64(0.1), "b": np.int32(2), "c": np.array([1.0, np.nan]), "d": (np.True_, -np.inf)}
    assert plain(values) == {"a": 0.1, "b": 2, "c": [1.0, None], "d": [True, None]}


def test_what_json_has_no_form_for_is_refused():
    with pytest.raises(TypeError, match="a value of type set cannot be written as JSON"):
        json_text({"a": {1, 2}})


def test_a_file_is_replaced_whole_and_nothing_is_left_beside_it(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    write_text(path, "new")
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["a.json"]


def test_a_write_that_fails_keeps_the_old_file(tmp_path, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device")

    path = tmp_path / "a.json"
    path.write_text("old")
    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(MmpError, match="cannot be written: No space left on device"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.json"]


def test_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / "target.json", tmp_path / "link.json"
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_new_file_has_the_rights_that_new_files_have(tmp_path):
    (tmp_path / "plain").touch()
    write_text(tmp_path / "a.json", "new")
    assert stat.S_IMODE((tmp_path / "a.json").stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)


@pytest.mark.parametrize("write", [check_writable, lambda path: write_text(path, "new")])
@pytest.mark.parametrize(
    ("name", "reason"),
    [("none/a.json", "No such file or directory"), ("", "not a regular file"), ("file/a.json", "Not a directory")],
)
def test_a_path_that_cannot_be_written_is_named_with_the_reason(tmp_path, name, reason, write):
    (tmp_path / "file").touch()
    with pytest.raises(MmpError, match=f"cannot be written: .*{reason}"):
        write(tmp_path / name)
    assert os.listdir(tmp_path) == ["file"]


@pytest.mark.parametrize("write", [check_writable, lambda path: write_text(path, "new")])
@pytest.mark.parametrize("end", ["/", "//", "/."])
@pytest.mark.parametrize("there", [False, True])
def test_a_path_that_ends_in_a_slash_is_no_file(tmp_path, write, end, there):
    if there:
        (tmp_path / "a.json").write_text("old")
    with pytest.raises(MmpError, match=r"a\.json/.* cannot be written: it ends like the path of a folder"):
        write(f"{tmp_path}/a.json{end}")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"] * there


def test_a_pipe_or_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(MmpError, match="not a regular file"):
        write_text(tmp_path / "pipe", "new")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_checking_a_path_changes_nothing(tmp_path):
    path = tmp_path / "a.json"
    check_writable(path)
    assert os.listdir(tmp_path) == []
    path.write_text("old")
    check_writable(path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.json"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_a_file_that_is_replaced_keeps_its_mode(tmp_path, mode):
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(mode)
    (tmp_path / "link.json").symlink_to(path)
    for name in ("a.json", "link.json"):
        write_text(tmp_path / name, "new")
        assert stat.S_IMODE(path.stat().st_mode) == mode
    assert (tmp_path / "link.json").is_symlink()


@pytest.mark.parametrize("write", [check_writable, lambda path: write_text(path, "new")])
def test_a_file_without_write_permission_is_not_replaced(write):
    with tempfile.TemporaryDirectory() as folder:
        path, user = Path(folder) / "a.json", os.geteuid()
        path.write_text("old")
        path.chmod(0o444)
        if user == 0:  # no mode restricts root
            for owned in (folder, path):
                os.chown(owned, _NOBODY, -1)
            os.seteuid(_NOBODY)
        try:
            with pytest.raises(MmpError, match=r"a\.json cannot be written: Permission denied"):
                write(path)
            assert os.listdir(folder) == ["a.json"]
        finally:
            os.seteuid(user)
        assert path.read_text() == "old"


def test_nobody_reads_a_secret_file_while_it_is_written(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(0o600)
    with whole_file(path) as temporary:
        temporary.write_text("new")
        assert stat.S_IMODE(temporary.stat().st_mode) == 0o600
