"""Check of the refusals of the command line, the same for every command and mistake."""

from __future__ import annotations

from typing import Any


def assert_refused(ran: Any, *words: str) -> None:
    """Checks that the command printed one sentence on stderr with these words, and ended with exit code 2."""
    assert ran.code == 2
    assert ran.out == ""
    assert ran.err.startswith("mmp: ")
    assert ran.err.count("\n") == 1
    assert "Traceback" not in ran.err
    for word in words:
        assert word in ran.err
