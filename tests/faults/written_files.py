"""Judges the files that a run wrote: each is whole, and the same as after a run where nothing failed."""

from __future__ import annotations

from pathlib import Path

from faults.growing_files import faults_of_growing
from faults.kit import HELPERS, OWN_CACHE, Run
from faults.reports import NUMBER
from faults.whole_files import READERS, broken, recorded_rows
from mmp_env.files.temporaries import PREFIX as TEMPORARY


def faults_of_files(run: Run, kind: str, good: Run) -> list[str]:
    """Returns what is wrong with the files that a run wrote, in words."""
    out, kept, known = [], run.kept, good.kept
    for name, path in kept.items():
        if name in run.before:
            continue
        if reason := broken(path):
            out.append(f"half-written {name}: {reason}")
        elif name in run.command.adds and name in known:
            out += faults_of_growing(run, kind, good, name)
        elif run.code != 0 and run.there.get(name) == path.read_bytes():
            continue  # the run did not come to it
        elif name not in known:
            out.append(f"wrote {name}, which is not there in the good run")
        elif reason := difference(path, known[name], timed=name in run.command.timed):
            out.append(f"half-written {name}: {reason}")
    found = {str(path.relative_to(run.folder)): path for path in _of_other_programs(run)}
    return out + [f"half-written {name}: {reason}" for name, path in found.items() if (reason := broken(path))]


def difference(path: Path, good: Path, *, timed: bool) -> str | None:
    """Returns how a whole file differs from that of the good run, or None.

    Commands write the same bytes in each run. Only numbers may differ in a `timed` file, which has times of the run.
    """
    if timed and path.suffix == ".rrd":
        there, wanted = recorded_rows(path), recorded_rows(good)
        return None if there == wanted else f"{there.total()} rows, not the {wanted.total()} of the good run"
    content, whole = path.read_bytes(), good.read_bytes()
    if timed:
        content, whole = (NUMBER.sub("#", each.decode()).encode() for each in (content, whole))
    return None if content == whole else f"{len(content)} bytes, not the {len(whole)} of the good run"


def _of_other_programs(run: Run) -> list[Path]:
    """Returns the files of other programs in the caches that have a reader."""
    found = [path for helper in HELPERS for path in sorted((run.folder / helper).rglob("*")) if path.is_file()]
    names = {path: str(path.relative_to(run.folder)) for path in found}
    return [
        path
        for path, name in names.items()
        if path.suffix in READERS and TEMPORARY not in name and not name.startswith(OWN_CACHE)
    ]
