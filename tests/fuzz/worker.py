"""A process that runs command lines and calls of the core: one JSON request a line in, one JSON answer a line out.

The number of the call of the core that runs is in the file of its first argument, so that it is known after a crash.
Standard error is a file to append to; an answer has what libraries wrote there past Python's streams.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any


def main() -> None:
    """Answers requests until the input ends."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    for request in sys.stdin:
        answer = _answer(json.loads(request), Path(sys.argv[1]))
        answers.write(json.dumps(answer) + "\n")


def _answer(request: dict[str, Any], place: Path) -> dict[str, Any]:
    if "call" in request:
        from fuzz import core_arrays, kept_calls

        returned, fault = core_arrays.attempt(*kept_calls.from_json(request["call"]))
        return {"returned": returned, "fault": fault}
    if "seed" in request:
        from fuzz import core_arrays

        return core_arrays.run(request["seed"], request["calls"], place)
    os.chdir(request["folder"])
    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = _command(request["line"], request.get("planted"))
    except BaseException:
        code = 70
        err.write(traceback.format_exc())
    os.chdir(tempfile.gettempdir())
    return {"code": code, "out": out.getvalue(), "err": err.getvalue(), "native": _native()}


def _native() -> str:
    """Returns what was written to the file of standard error since the last request, and empties it."""
    if not os.fstat(2).st_size:
        return ""
    text = Path(os.readlink("/proc/self/fd/2")).read_text(encoding="utf-8", errors="replace")
    os.ftruncate(2, 0)
    return text


def _command(line: list[str], planted: str | None) -> int:
    from mmp_cli.main import main as run

    try:
        if planted is not None:
            from fuzz import planted_faults

            getattr(planted_faults, planted)(line)
        return run(line)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)


if __name__ == "__main__":
    main()
