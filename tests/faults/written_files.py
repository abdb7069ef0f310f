"""Judges the files that a run wrote: each is whole, and the same as after a run where nothing failed."""

from __future__ import annotations

from pathlib import Path

from faults.growing_files import faults_of_growing
from faults.kit import HELPERS, OWN_CACHE, Run
from faults.pictures import PICTURES, unlike
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
        elif reason := _difference(run, kind, name, known[name]):
            out.append(f"half-written {name}: {reason}")
    found = {str(path.relative_to(run.folder)): path for path in _of_other_programs(run)}
    return out + [f"half-written {name}: {reason}" for name, path in found.items() if (reason := broken(path))]


def _difference(run: Run, kind: str, name: str, good: Path) -> str | None:
    """Returns how a whole file differs from that of the good run, or None.

    Commands write the same bytes in each run. Only numbers may differ in a `timed` file, which has times of the run.
    Without memory, OpenGL may draw a little differently, and a recording may end where the run failed, if a sentence
    says so.
    """
    path, timed = run.folder / name, name in run.command.timed
    if timed and path.suffix == ".rrd":
        there, wanted = recorded_rows(path), recorded_rows(good)
        says_so = f"mmp: the recording {name} ends where the run failed\n" in run.err
        is_whole = there <= wanted if kind == "memory" and says_so and run.code == 2 else there == wanted
        return None if is_whole else f"{there.total()} rows, not the {wanted.total()} of the good run"
    content, whole = path.read_bytes(), good.read_bytes()
    if timed:
        content, whole = (NUMBER.sub("#", each.decode()).encode() for each in (content, whole))
    if content == whole:
        return None
    if kind == "memory" and path.suffix in PICTURES:
        return unlike(path, good)
    return f"{len(content)} bytes, not the {len(whole)} of the good run"


def _of_other_programs(run: Run) -> list[Path]:
    """Returns the files of other programs in the caches that have a reader."""
    found = [path for helper in HELPERS for path in sorted((run.folder / helper).rglob("*")) if path.is_file()]
    names = {path: str(path.relative_to(run.folder)) for path in found}
    return [
        path
        for path, name in names.items()
        if path.suffix in READERS and TEMPORARY not in name and not name.startswith(OWN_CACHE)
    ]
