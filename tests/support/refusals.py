"""How the command line refuses: the same for every command and every mistake."""

from __future__ import annotations

from typing import Any


def assert_refused(ran: Any, *words: str) -> None:
    """One sentence on stderr that names what is wrong, exit 2, and nothing else."""
    assert ran.code == 2
    assert ran.out == ""
    assert ran.err.startswith("mmp: ")
    assert ran.err.count("\n") == 1
    assert "Traceback" not in ran.err
    for word in words:
        assert word in ran.err
