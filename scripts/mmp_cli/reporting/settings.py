"""`settings.json`, which `mmp bench` writes beside the results: what was asked for, and what of it is missing yet."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from mmp_cli.arguments import LARGEST_SEED
from mmp_cli.benchmark.job import MOST_UNITS
from mmp_cli.benchmark.result_line import LARGEST, Line
from mmp_cli.benchmark.settings import SCHEMA, SETTINGS
from mmp_cli.benchmark.sources import DRAWN_COUNT
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, real_path
from mmp_env.files.reading import Location, check_schema, decode, named, names_file, read_document
from mmp_env.gym.instances import DEFAULT_TASK
from mmp_env.model.arm import LARGEST_M
from mmp_env.model.margins import asked_margins


class Variant(msgspec.Struct, frozen=True, kw_only=True):
    """A planner as it was run: its label, its registered name and the options that were set."""

    label: str
    name: str
    options: dict[str, Any] = msgspec.field(default_factory=dict)


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked for. `time_limit_s` None: no limit; `count` None: all of a file, 50 of anything drawn."""

    schema: str
    sources: list[str]
    planners: list[Variant]
    digests: list[str] = []
    count: int | None = None
    seed: int = 0
    time_limit_s: float | None = None
    robot: str | None = None
    task: str | None = None
    margin: float | dict[str, float] | None = None
    exact: bool = False
    memory_limit_mb: int | None = None
    save_plans: bool = False
    version: str | None = None


@dataclass(frozen=True, kw_only=True)
class Missing:
    """Units that were asked for and have no line. `unknown`: sources that cannot be read here, so nobody can say."""

    units: int = 0
    expected: int = 0
    by_planner: dict[str, int] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()


def read_settings(folder: Path) -> Settings | None:
    """The settings of a benchmark folder, None where there are none. Raises `MmpError`."""
    path = folder / SETTINGS
    if not exists(path):
        return None
    place = Location(str(path))
    data = read_document(path)
    check_schema(data, SCHEMA, place)
    settings = decode(data, Settings, place)
    _check(settings, place)
    return settings


def may_be_read(source: str, folder: Path) -> bool:
    """Returns whether a source is no file, or a file in the current folder or beside the results, or below these.

    Settings may come from elsewhere: they do not make a report read any other file.
    """
    try:
        if not (names_file(source) or exists(source)):
            return True
        roots = real_path("."), real_path(folder).parent
        return any(real_path(source).is_relative_to(root) for root in roots if root != root.parent)
    except MmpError:
        return False


def _check(settings: Settings, place: Location) -> None:
    """Raises `MmpError` for numbers that no benchmark has."""
    with named(place):
        asked = asked_margins(settings.margin)
    bounds = {
        "count": (settings.count, 1, MOST_UNITS),
        "seed": (settings.seed, 0, LARGEST_SEED),
        "time_limit_s": (settings.time_limit_s, 0, LARGEST),
        **{f"margin.{kind}": (metres, 0, LARGEST_M) for kind, metres in asked.items()},
        "memory_limit_mb": (settings.memory_limit_mb, 1, LARGEST),
    }
    for name, (value, least, most) in bounds.items():
        if value is not None and not least <= value <= most:
            raise (place / name).wrong(value, f"a number from {least} to {most:g}")
    for name, most in (("sources", 1000), ("planners", 1000), ("digests", 1000)):
        if (count := len(getattr(settings, name))) > most:
            raise MmpError(f"{place / name} has {count} entries; it must have at most {most}")
    units = (settings.count or DRAWN_COUNT) * len(settings.sources) * len(settings.planners)
    if units > MOST_UNITS:
        raise MmpError(f"{place / 'count'} makes {units} units; a benchmark has at most {MOST_UNITS}")


def missing(settings: Settings, lines: Iterable[Line], folder: Path) -> Missing:
    """What the results lack."""
    done = {(line.instance, line.planner) for line in lines}
    names: list[str] = []
    unknown = []
    for source in settings.sources:
        expected = _instances(settings, source) if may_be_read(source, folder) else None
        names += expected or []
        unknown += [] if expected is not None else [without_place(source)]
    counts = {x.label: sum((name, x.label) not in done for name in names) for x in settings.planners}
    return Missing(
        units=sum(counts.values()),
        expected=len(names) * len(settings.planners),
        by_planner={label: count for label, count in counts.items() if count},
        unknown=tuple(unknown),
    )


def bench_command(settings: Settings, folder: Path) -> str:
    """The command line that makes these results again, in the folder that holds the one of the results."""
    sources = [without_place(source) for source in settings.sources]
    planners = [x.label if x.label == x.name else f"{x.label}={x.name}" for x in settings.planners]
    words = ["mmp", "bench", *sources, "--planners", ",".join(planners)]
    for option, value in (
        ("count", settings.count),
        ("seed", settings.seed),
        ("time-limit", "inf" if settings.time_limit_s is None else f"{settings.time_limit_s:g}"),
        ("robot", settings.robot),
        # An instance file takes no task, so the usual one is left unsaid.
        ("task", None if settings.task == DEFAULT_TASK else settings.task),
        ("margin", ",".join(f"{kind}={m}" for kind, m in asked_margins(settings.margin).items()) or None),
        ("memory-limit", settings.memory_limit_mb),
    ):
        words += [] if value is None else [f"--{option}", str(value)]
    for x in settings.planners:
        for key, value in x.options.items():
            words += ["--set", f"{x.label}.{key}={option_text(value)}"]
    words += ["--exact"] * settings.exact + ["--save-plans"] * settings.save_plans
    return shlex.join([*words, "--out", real_path(folder).name])


def report_command(
    folder: Path, against: Sequence[str], note: str | None, title: str | None, reference: str | None
) -> str:
    """The command line that makes this report again, in that folder too."""
    words = ["mmp", "report", real_path(folder).name]
    for path in against:
        words += ["--against", Path(path).name]
    for option, value in (("--against-note", note), ("--title", title), ("--reference", reference)):
        words += [] if value is None else [option, value]
    return shlex.join(words)


def option_text(value: object) -> str:
    """The value of an option as `--set` takes it."""
    return str(value).lower() if isinstance(value, bool) else "null" if value is None else str(value)


def without_place(source: str) -> str:
    """The name alone of a file; a page that is passed on says nothing of our machine."""
    return Path(source).name if names_file(source) else source


def _instances(settings: Settings, source: str) -> list[str] | None:
    """The names of a source's instances as they stand in results; None where its file cannot be read here."""
    drawn = range(settings.seed, settings.seed + (DRAWN_COUNT if settings.count is None else settings.count))
    if not names_file(source):
        name = source.rpartition(":")[2]
        return [f"{name}/{seed}" for seed in drawn]
    try:
        data = read_document(source)
    except MmpError:
        return None
    if not isinstance(data, dict):
        return None
    stem = data.get("name") or Path(source).stem
    if not isinstance(data.get("instances"), list):
        return [f"{stem}/{seed}" for seed in drawn]
    cell = data.get("cell")
    stem = (cell.get("name") if isinstance(cell, dict) else None) or stem
    names = [item.get("name") for item in data["instances"][: settings.count] if isinstance(item, dict)]
    return [f"{stem}/{name}" for name in names]
