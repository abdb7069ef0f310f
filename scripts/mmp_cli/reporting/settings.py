"""`settings.json`, which `mmp bench` writes beside the results: the settings, and the units that are missing yet."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mmp_cli.benchmark.result_line import Line
from mmp_cli.benchmark.settings import SETTINGS, Settings, load_settings
from mmp_cli.benchmark.sources import DRAWN_COUNT
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, real_path
from mmp_env.files.reading import Location, decode, names_file, read_document
from mmp_env.gym.instances import DEFAULT_TASK
from mmp_env.model.margins import asked_margins


@dataclass(frozen=True, kw_only=True)
class Missing:
    """Units without a result. `unknown` are sources that cannot be read here, whose units are not known."""

    units: int = 0
    expected: int = 0
    by_planner: dict[str, int] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()


def read_settings(folder: Path) -> Settings | None:
    """Returns the settings of a benchmark folder, or None if there are none. Raises `MmpError`."""
    data = load_settings(folder)
    return None if data is None else decode(data, Settings, Location(str(folder / SETTINGS)))


def may_be_read(source: str, folder: Path) -> bool:
    """Returns whether a source is no file, or a file in or below the current folder or the parent of the results.

    Settings may come from elsewhere; they must not make a report read any other file.
    """
    try:
        if not (names_file(source) or exists(source)):
            return True
        roots = real_path("."), real_path(folder).parent
        return any(real_path(source).is_relative_to(root) for root in roots if root != root.parent)
    except MmpError:
        return False


def missing(settings: Settings, lines: Iterable[Line], folder: Path) -> Missing:
    """Returns the units that the results lack."""
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
    """Returns the command line that makes these results again, in the parent of the folder."""
    sources = [without_place(source) for source in settings.sources]
    planners = [x.label if x.label == x.name else f"{x.label}={x.name}" for x in settings.planners]
    words = ["mmp", "bench", *sources, "--planners", ",".join(planners)]
    for option, value in (
        ("count", settings.count),
        ("seed", settings.seed),
        ("time-limit", "inf" if settings.time_limit_s is None else f"{settings.time_limit_s:g}"),
        ("robot", settings.robot),
        # An instance file takes no task, so the default one is left out.
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
    """Returns the command line that makes this report again, in the parent of the folder."""
    words = ["mmp", "report", real_path(folder).name]
    for path in against:
        words += ["--against", Path(path).name]
    for option, value in (("--against-note", note), ("--title", title), ("--reference", reference)):
        words += [] if value is None else [option, value]
    return shlex.join(words)


def option_text(value: object) -> str:
    """Returns the value of an option as `--set` takes it."""
    return str(value).lower() if isinstance(value, bool) else "null" if value is None else str(value)


def without_place(source: str) -> str:
    """Returns the name of a file without its folder, which a published page should not contain."""
    return Path(source).name if names_file(source) else source


def _instances(settings: Settings, source: str) -> list[str] | None:
    """Returns the names of a source's instances in the results, or None if its file cannot be read here."""
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
