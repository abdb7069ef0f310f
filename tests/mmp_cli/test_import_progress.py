"""Progress of imports where standard error is no terminal."""

import time

import pytest

from mmp_cli import import_progress
from mmp_cli.import_progress import ImportProgress


def test_a_long_step_is_told_while_it_runs(monkeypatch, capsys):
    monkeypatch.setattr(import_progress, "FIRST_S", 0.01)
    with ImportProgress("mmp robot add") as progress:
        progress("upper: 60 \x1b spheres")
        told = ""
        while not told:
            time.sleep(0.01)
            told = capsys.readouterr().err
    assert told.startswith("mmp robot add: 0 s, last step: upper: 60 \\x1b spheres")


def test_a_short_import_prints_nothing_and_no_line_comes_after_the_end(monkeypatch, capsys):
    monkeypatch.setattr(import_progress, "FIRST_S", 1e6)
    with ImportProgress("mmp robot add") as progress:
        progress("upper: 60 spheres")
    assert capsys.readouterr().err == ""


def test_an_interrupt_ends_the_lines(capsys):
    with pytest.raises(KeyboardInterrupt), ImportProgress("mmp robot add"):
        raise KeyboardInterrupt
    assert capsys.readouterr().err == ""
