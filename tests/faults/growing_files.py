"""Judges the files that a command adds entries to: results of a benchmark, and the index of a dataset."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from faults.kit import Run

MAY_FAIL = ("memory", "kill")
"""Kinds in which a worker may get no memory or be killed, so that an entry reports an error."""


def entries(name: str, content: bytes) -> list[str]:
    """Returns the entries of a file that grows: its whole lines, or the instances of an index."""
    if name.endswith(".jsonl"):
        return [row.decode() for row in content.split(b"\n")[:-1]]
    try:
        return [json.dumps(entry, sort_keys=True) for entry in json.loads(content)["instances"]]
    except (ValueError, KeyError, TypeError):
        return []  # then it is half written


def faults_of_growing(run: Run, kind: str, good: Run, name: str) -> list[str]:
    """Returns what is wrong with the entries of a file, in words: lost, strange, incomplete and missing ones."""
    content, wanted = (run.folder / name).read_bytes(), (good.folder / name).read_bytes()
    rows, old = entries(name, content), entries(name, run.there.get(name, b""))
    out = [f"lost {row[:80]!r} of {name}" for row in old if row not in rows]
    known = {_key(row): row for row in entries(name, wanted)}
    count = Counter(map(_key, rows))
    out += [f"{name} has {key} {times} times" for key, times in count.items() if times > 1]
    out += [f"{name} has {key}, which is strange" for key in count if key not in known]
    if run.code == 0:
        out += [f"exit code 0 without {key} in {name}" for key in known if key not in count]
        if name.endswith(".jsonl") and not content.endswith(b"\n"):
            out.append(f"half-written {name}: no end of the last line")
    for row in rows:
        if _reports_error(row) and (kind in MAY_FAIL or row in old):
            continue
        if _key(row) in known and _form(name, row) != _form(name, known[_key(row)]):
            out.append(f"half-written {name}: {row[:80]!r} has other fields than in the good run")
    if name.endswith(".json") and _rest(content) != _rest(wanted):
        out.append(f"half-written {name}: not the settings of the good run")
    return out


def has_errors(run: Run) -> bool:
    """Returns True if an entry of the run reports an error, so that its row of the printed table has no times."""
    found = [(name, run.folder / name) for name in run.command.adds]
    return any(
        _reports_error(row) for name, path in found if path.is_file() for row in entries(name, path.read_bytes())
    )


def _key(row: str) -> str:
    entry = fields(row)
    return " ".join(str(entry[field]) for field in ("instance", "planner", "name", "seed") if field in entry)


def _form(name: str, row: str) -> Any:
    """Returns what is the same in each run: the entry of an index, or the names of the fields of a result."""
    entry = fields(row)
    return (set(entry), entry.get("status")) if name.endswith(".jsonl") else entry


def _reports_error(row: str) -> bool:
    entry = fields(row)
    return "error" in (entry.get("status"), entry.get("outcome"))


def _rest(content: bytes) -> dict[str, Any]:
    return {key: value for key, value in fields(content).items() if key != "instances"}


def fields(text: str | bytes) -> dict[str, Any]:
    """Returns the fields of an entry or document; none if it is no object."""
    try:
        value = json.loads(text)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}
