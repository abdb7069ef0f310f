"""Reading `results.jsonl`: one line per unit, a unit being an instance, a planner and a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import msgspec

from mmp_cli.benchmark.folder import RESULTS
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.paths import is_folder
from mmp_env.reading import Place, decode, parse_json
from mmp_planners import Status

_MOST_BYTES = 2**30


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """One line; what did not come about, or is not counted by the planner, is None. `planner` is the label.

    A line without generated nodes has no conflict tree, and so no expanded nodes either.
    """

    instance: str
    planner: str
    status: str
    seed: int = 0
    cell: str | None = None
    arms: int | None = None
    planning_time_s: float | None = None
    check_time_s: float | None = None
    expanded_nodes: float | None = None
    generated_nodes: float | None = None
    fast_track_tries: float | None = None
    fast_track_hits: float | None = None
    cost_rad: float | None = None
    makespan_s: float | None = None
    root_conflicts: float | None = None
    cost_lower_bound_rad: float | None = None
    min_clearance_m: float | None = None
    bound_met: bool | None = None
    deadline_hit: bool | None = None
    message: str | None = None
    version: str | None = None
    machine: str | None = None

    @property
    def source(self) -> str:
        """Name of the cell, or environment id: what stands before the first slash of the instance."""
        return self.instance.partition("/")[0]

    @property
    def section(self) -> str:
        """Which part of the report it belongs to."""
        return self.cell or self.source

    @property
    def problem(self) -> tuple[str, int]:
        """What planners are compared on: the instance and the seed."""
        return self.instance, self.seed

    @property
    def cost_ratio(self) -> float | None:
        """Cost by the sum of the straight lines; None without a plan, or where start and goal are the same."""
        if self.cost_rad is None or not self.cost_lower_bound_rad:
            return None
        return self.cost_rad / self.cost_lower_bound_rad


_NUMBERS = tuple(f.name for f in msgspec.structs.fields(Line) if f.type == float | None)


@dataclass(frozen=True, kw_only=True, eq=False)
class Results:
    """The units of a folder in the order of the file.

    `torn`: the last line was cut off and left out; `repeated`: lines of units that stand before (the first counts).
    """

    lines: tuple[Line, ...]
    torn: bool
    repeated: int


def read_results(folder: Path) -> Results:
    """The results of a benchmark folder. Raises `MmpError` for a folder without any, or with a line that is none."""
    path = folder / RESULTS
    rows = _text(folder, path).split("\n")
    # A line counts once its line feed is written: what follows the last one is a line that was cut off.
    torn = bool(rows.pop().strip())
    units: dict[tuple[str, str, int], Line] = {}
    filled = [(number, row) for number, row in enumerate(rows, 1) if row.strip()]
    for number, row in filled:
        line = _line(row, Place(f"{path} line {number}"))
        units.setdefault((line.instance, line.planner, line.seed), line)
    if not units:
        raise MmpError(f"{path} holds no result yet; `mmp bench --out {folder}` writes them")
    return Results(lines=tuple(units.values()), torn=torn, repeated=len(filled) - len(units))


def _text(folder: Path, path: Path) -> str:
    if not is_folder(folder):
        raise MmpError(f"{folder} is not a folder; give the one that `mmp bench --out` has written")
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise MmpError(f"{path} is larger than {_MOST_BYTES / 2**20:g} MB, the most that is read")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MmpError(f"{folder} has no {RESULTS}; give the folder that `mmp bench --out` has written") from None
    except OSError as error:
        raise MmpError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise MmpError(f"{path} is not text in UTF-8 (at byte {error.start})") from None


def _line(row: str, place: Place) -> Line:
    data = parse_json(row, place)
    if not isinstance(data, dict):
        raise place.wrong(data, "an object")
    line = decode(data, Line, place)
    if line.status not in list(Status):
        raise MmpError(f"{place}: {UnknownNameError('status', line.status, Status)}")
    for name in _NUMBERS:
        value = getattr(line, name)
        if value is not None and not (math.isfinite(value) and (value >= 0 or name == "min_clearance_m")):
            raise (place / name).wrong(value, "a finite number from 0, or null")
    return msgspec.structs.replace(line, expanded_nodes=None) if line.generated_nodes == 0 else line
