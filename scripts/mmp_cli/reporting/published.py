"""Published results of others: a CSV with the columns instance, planner, solved, planning_time_s, cost_rad.

Lines before the head that begin with `#` describe machine and time limit.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mmp_cli.benchmark.result_line import LARGEST
from mmp_cli.reporting.sections import Section
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.regular_files import read_bytes
from mmp_env.wording import shown

COLUMNS = ("instance", "planner", "solved", "planning_time_s", "cost_rad")
NOTHING_KNOWN = "the file does not say on what machine and with what time limit it was made"
_MOST_BYTES = 64 * 2**20
_YES, _NO = ("1", "true", "yes"), ("0", "false", "no")


@dataclass(frozen=True, kw_only=True)
class Row:
    """One published result; `cost_rad` is None if the file has none."""

    instance: str
    planner: str
    solved: bool
    planning_time_s: float | None
    cost_rad: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Published:
    """A file: its name, a note on how it was made, and its rows."""

    name: str
    note: str
    rows: tuple[Row, ...]

    @property
    def planners(self) -> list[str]:
        """Returns the planners in the order of the file."""
        return list(dict.fromkeys(row.planner for row in self.rows))


def read_published(path: str, note: str | None = None) -> Published:
    """Returns the rows of a file; `note` comes before its comments. Raises `MmpError` that names line and column."""
    lines = _text(path).splitlines()
    comments = []
    while lines and (not lines[0].strip() or lines[0].startswith("#")):
        comments.append(lines.pop(0).lstrip("# ").strip())
    first = len(comments) + 1
    reader = csv.reader(lines, strict=True)
    try:
        table = [(first + reader.line_num - 1, row) for row in reader if row]
    except csv.Error as error:
        raise MmpError(f"{path} line {first + reader.line_num - 1} is not CSV: {error}") from None
    rows: dict[tuple[str, str], Row] = {}
    head = _head(path, table)
    for number, cells in table[1:]:
        row = _row(f"{path} line {number}", head, cells)
        if (row.instance, row.planner) in rows:
            raise MmpError(f"{path} line {number} has instance '{row.instance}' of '{row.planner}' a second time")
        rows[row.instance, row.planner] = row
    if not rows:
        raise MmpError(f"{path} has no result below its head")
    known = [x for x in (note, *comments) if x]
    return Published(name=Path(path).name, note="; ".join(known) or NOTHING_KNOWN, rows=tuple(rows.values()))


def match(published: Published, sections: Sequence[Section]) -> dict[str, dict[str, list[Row]]]:
    """Returns section name -> full name of one of our instances -> its rows.

    A bare name means the cell that the file is named after, or the only one with such an instance. Raises `MmpError` if
    several cells match, and if there is no common instance.
    """
    out: dict[str, dict[str, list[Row]]] = {}
    for row in published.rows:
        found = _homes(published, row, sections)
        if len(found) > 1:
            cells = ", ".join(section.name for section, _ in found)
            raise MmpError(
                f"{published.name}: instance '{row.instance}' could be of {cells}; write <cell>/{row.instance}, or "
                "begin the file's name with that of the cell"
            )
        for section, name in found:
            out.setdefault(section.name, {}).setdefault(name, []).append(row)
    if not out:
        ours = next(name for section in sections for name in section.instances)
        theirs = published.rows[0].instance
        raise MmpError(
            f"{published.name} has no instance in common with the results: it names '{theirs}' and the like, the "
            f"results '{ours}' and the like"
        )
    return out


def unknown(published: Published, matched: Mapping[str, Mapping[str, Sequence[Row]]]) -> list[str]:
    """Returns the instances of the file that are not in the results; for `matched` see `match`."""
    found = {row.instance for rows in matched.values() for found_rows in rows.values() for row in found_rows}
    return list(dict.fromkeys(row.instance for row in published.rows if row.instance not in found))


def _homes(published: Published, row: Row, sections: Iterable[Section]) -> list[tuple[Section, str]]:
    """Returns the sections that have the instance, with its full name there."""
    found = []
    for section in sections:
        for name in section.instances:
            cell, _, bare = name.partition("/")
            if row.instance in (name, bare):
                found.append((section, name, cell))
    named = [x for x in found if x[2] == published.name.partition(".")[0]]
    return [(section, name) for section, name, _ in named or found]


def _text(path: str) -> str:
    try:
        return read_bytes(path, _MOST_BYTES, "CSV").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MmpError(f"{path} is not text in UTF-8 (at byte {error.start}); it must be a CSV file") from None


def _head(path: str, table: Sequence[tuple[int, list[str]]]) -> dict[str, int]:
    """Returns column -> index. Raises `MmpError` for a missing column."""
    names = [cell.strip() for cell in table[0][1]] if table else []
    for column in COLUMNS:
        if column not in names:
            raise MmpError(f"{path} has no column '{column}'; its head must have {', '.join(COLUMNS)}")
    return {name: index for index, name in enumerate(names)}


def _row(place: str, head: dict[str, int], cells: Sequence[str]) -> Row:
    if len(cells) != len(head):
        raise MmpError(f"{place} has {len(cells)} columns; its head has {len(head)}")
    field = {name: cells[index].strip() for name, index in head.items()}
    for name in ("instance", "planner"):
        if not field[name]:
            raise MmpError(f"{place} has no {name}")
    if field["solved"].lower() not in _YES + _NO:
        raise MmpError(f"{place}: {UnknownNameError('value of solved', field['solved'], ('0', '1'))}")
    solved = field["solved"].lower() in _YES
    time, cost = (_number(place, name, field[name]) for name in ("planning_time_s", "cost_rad"))
    if solved and time is None:
        raise MmpError(f"{place} is solved and has no planning_time_s")
    return Row(instance=field["instance"], planner=field["planner"], solved=solved, planning_time_s=time, cost_rad=cost)


def _number(place: str, column: str, text: str) -> float | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= LARGEST:
        raise MmpError(f"{place}: {column} is {shown(text)}; it must be a number from 0 to {LARGEST:g}, or nothing")
    return value
