"""Paths that the system refuses: one sentence each."""

import errno
import os

import pytest
from support import bad_files

from mmp_env import MmpError, find_cell, load_cell, load_plan, save_plan
from mmp_env.files.paths import exists, is_file, is_folder, real_path, status
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.files.writing import check_writable, write_text

IMPOSSIBLE = ["a" * 300, "a\0b", "no/such/folder"]


@pytest.fixture
def forbidden(tmp_path, monkeypatch):
    """Returns a path that `os.stat` refuses. Permissions would not do: the tests may run as root."""
    path, ask = tmp_path / "locked" / "file.json", os.stat

    def stat(asked, *args, **options):
        if os.fspath(asked) == os.fspath(path):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), os.fspath(asked))
        return ask(asked, *args, **options)

    monkeypatch.setattr(os, "stat", stat)
    return path


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """Changes into a working directory and deletes it."""
    monkeypatch.chdir(tmp_path)
    here = tmp_path / "gone"
    here.mkdir()
    os.chdir(here)
    here.rmdir()


def test_files_folders_and_missing_paths_are_distinguished(tmp_path):
    file = tmp_path / "file"
    file.write_text("content")
    link = tmp_path / "link"
    link.symlink_to(file)
    assert [(exists(path), is_file(path), is_folder(path)) for path in (file, link, tmp_path, tmp_path / "none")] == [
        (True, True, False),
        (True, True, False),
        (True, False, True),
        (False, False, False),
    ]
    assert real_path(link) == file
    assert status(link).st_size == 7


@pytest.mark.parametrize("path", IMPOSSIBLE)
def test_a_name_that_no_file_can_have_is_nothing_there(path):
    assert not exists(path)


def test_a_path_that_the_system_refuses_is_one_sentence(forbidden):
    with pytest.raises(MmpError, match=r"file\.json cannot be looked at: Permission denied$"):
        exists(forbidden)


def test_a_deleted_working_directory_is_called_so(nowhere):
    with pytest.raises(MmpError, match=r"^plan\.json cannot be found: the working directory was deleted$"):
        real_path("plan.json")


@pytest.mark.parametrize("path", IMPOSSIBLE)
def test_readers_and_writers_refuse_a_name_that_no_file_can_have(path):
    for read in (load_cell, load_plan):
        with pytest.raises(MmpError, match="cannot be read: "):
            read(path)
    plan = plan_from_dict(bad_files.good_plan())
    for write in (check_writable, lambda path: write_text(path, ""), lambda path: save_plan(plan, path)):
        with pytest.raises(MmpError, match=r"cannot be (written|found): "):
            write(path)
    with pytest.raises(MmpError, match=r"unknown cell|cannot be read: "):
        find_cell(path)


def test_readers_and_writers_refuse_a_place_without_permission(forbidden):
    for use in (load_cell, load_plan, find_cell, check_writable, lambda path: write_text(path, "")):
        with pytest.raises(MmpError, match=r"cannot be (looked at|read): Permission denied$"):
            use(forbidden)


def test_writers_refuse_a_deleted_working_directory(nowhere):
    with pytest.raises(MmpError, match="the working directory was deleted"):
        check_writable("plan.json")
    with pytest.raises(MmpError, match="cannot be read: No such file"):
        load_plan("plan.json")


def test_a_name_that_is_not_utf_8_is_allowed(tmp_path):
    path = tmp_path / os.fsdecode(b"caf\xe9.json")
    save_plan(plan_from_dict(bad_files.good_plan()), path)
    assert load_plan(path).makespan_s > 0
