"""A process that runs command lines and calls of the core: one JSON request a line in, one JSON answer a line out.

The number of the call of the core that runs is in the file of its first argument, so that it is known after a crash.
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
    if "seed" in request:
        from fuzz import core_arrays

        if "name" in request:
            return {"returned": core_arrays.attempt(request["name"], request["seed"])}
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
    return {"code": code, "out": out.getvalue(), "err": err.getvalue()}


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
