"""Reading `results.jsonl`: a line per unit, which is an instance, a planner and a seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mmp_cli.benchmark.folder import MOST_BYTES, RESULTS
from mmp_cli.benchmark.result_line import Line, read_line
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_folder
from mmp_env.files.reading import Location
from mmp_env.files.regular_files import read_bytes


@dataclass(frozen=True, kw_only=True, eq=False)
class Results:
    """The units of a folder in the order of the file.

    `numbers` are those of the lines in the file, from 1.
    `torn` says that the last line was cut off and left out; `repeated` counts lines of units that occur before them.
    """

    lines: tuple[Line, ...]
    numbers: tuple[int, ...]
    torn: bool
    repeated: int


def read_results(folder: Path) -> Results:
    """Returns the results of a benchmark folder. Raises `MmpError` if it has none, or a line that is no result."""
    path = folder / RESULTS
    rows = _text(folder, path).split("\n")
    # A line counts once its line feed is written; text after the last one is a line that was cut off.
    torn = bool(rows.pop().strip())
    units: dict[tuple[str, str, int], tuple[int, Line]] = {}
    filled = [(number, row) for number, row in enumerate(rows, 1) if row.strip()]
    for number, row in filled:
        line = read_line(row, Location(f"{path} line {number}"))
        units.setdefault((line.instance, line.planner, line.seed), (number, line))
    if not units:
        raise MmpError(f"{path} holds no result yet; `mmp bench --out {folder}` writes them")
    numbers, lines = zip(*units.values(), strict=True)
    return Results(lines=lines, numbers=numbers, torn=torn, repeated=len(filled) - len(units))


def _text(folder: Path, path: Path) -> str:
    if not is_folder(folder):
        raise MmpError(f"{folder} is not a folder; give the one that `mmp bench --out` has written")
    if not exists(path):
        raise MmpError(f"{folder} has no {RESULTS}; give the folder that `mmp bench --out` has written")
    try:
        return read_bytes(path, MOST_BYTES, "results").decode()
    except UnicodeDecodeError as error:
        raise MmpError(f"{path} is not text in UTF-8 (at byte {error.start})") from None
