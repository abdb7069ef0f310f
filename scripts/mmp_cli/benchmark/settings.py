"""settings.json: the settings of a folder of results, which a second start must repeat or enlarge."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from mmp_cli.arguments import LARGEST_SEED
from mmp_cli.benchmark.job import MOST_UNITS, Job
from mmp_cli.benchmark.known_sources import (
    COLUMNS,
    KnownSource,
    changed_sources,
    columns_of,
    grown_sources,
    known_sources,
)
from mmp_cli.benchmark.result_line import LARGEST
from mmp_cli.benchmark.sources import DRAWN_COUNT, Drawn
from mmp_cli.machine import version
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.files.reading import Location, check_schema, decode, named, read_document
from mmp_env.files.writing import json_text, plain, write_text
from mmp_env.model.arm import LARGEST_M
from mmp_env.model.margins import asked_margins
from mmp_env.wording import shown

SETTINGS = "settings.json"
SCHEMA = "mmp-bench/1"
_GROWING = (*COLUMNS, "planners", "count")
"""Settings that a later start may enlarge."""
_MOST_ENTRIES = 1000
"""Largest number of sources or planners."""


class Variant(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A planner of a benchmark: label, registered name and options."""

    label: str
    name: str
    options: dict[str, Any] = msgspec.field(default_factory=dict)


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Settings of a benchmark. No `time_limit_s` means no limit; no `count` means all of a file, or 50 drawn ones."""

    schema: str
    sources: list[str]
    planners: list[Variant]
    digests: list[str] = []
    names: list[list[str]] = []
    hashes: list[list[str]] = []
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


def settings_of(args: Namespace, job: Job) -> dict[str, Any]:
    """Returns all settings that results depend on, as JSON values; workers, cluster and folder are not among them."""
    drawn = [source for source in job.sources if isinstance(source, Drawn)]
    return plain(
        {
            "schema": SCHEMA,
            "sources": list(args.sources),
            "digests": [source.digest for source in job.sources],
            "names": [list(source.names) for source in job.sources],
            "hashes": [list(source.hashes) for source in job.sources],
            "planners": [
                {"label": variant.label, "name": variant.name, "options": dict(variant.options)}
                for variant in job.variants.values()
            ],
            "count": args.count,
            "seed": args.seed,
            "time_limit_s": job.time_limit_s,
            "robot": args.robot,
            "task": drawn[0].task if drawn else None,
            "margin": args.margin,
            "exact": job.exact,
            "memory_limit_mb": job.memory_limit_mb,
            "save_plans": job.save_plans,
            "version": version(),
        }
    )


def load_settings(folder: Path) -> dict[str, Any] | None:
    """Returns the settings of a folder, or None if there are none yet. Raises `MmpError`."""
    path = folder / SETTINGS
    if not exists(path):
        return None
    data = read_document(path)
    place = Location(str(path))
    check_schema(data, SCHEMA, place)
    _check(decode(data, Settings, place), place)
    return data


def _check(settings: Settings, place: Location) -> None:
    """Raises `MmpError` for numbers that no benchmark can have."""
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
    for name in (*COLUMNS, "planners"):
        if (count := len(getattr(settings, name))) > _MOST_ENTRIES:
            raise MmpError(f"{place / name} has {count} entries; it must have at most {_MOST_ENTRIES}")
        if name in COLUMNS and count not in (0, len(settings.sources)):
            raise MmpError(
                f"{place / name} has {count} entries; it must have {len(settings.sources)}, as 'sources' has"
            )
    units = _units(settings.count, settings.sources, settings.planners)
    if units > MOST_UNITS:
        raise MmpError(f"{place / 'count'} makes {units} units; a benchmark has at most {MOST_UNITS}")


def _units(count: int | None, sources: Sequence[str], planners: Sequence[Any]) -> int:
    return (count or DRAWN_COUNT) * len(sources) * len(planners)


def save_settings(settings: Mapping[str, Any], folder: Path) -> None:
    """Writes the settings. Raises `MmpError` if that fails."""
    write_text(folder / SETTINGS, json_text(settings))


def grown(there: Mapping[str, Any], here: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Returns the settings of a folder together with those of another start.

    The other start may add sources, instances at the end of a file, planners and count.

    Raises:
        MmpError: names the settings that differ, if results of both starts cannot be compared; or instances of two
            sources have the same name, or there are too many units.
    """
    known, own = known_sources(there), known_sources(here)
    differences = _changed_planners(there, here)
    if changed := changed_sources(known, own):
        differences.insert(0, f"the cell or the instances of {', '.join(changed)} are not what they were")
    for key in here:
        no_task = key == "task" and None in (there.get(key), here[key])  # no instance is drawn on one of the sides
        if key not in _GROWING and there.get(key) != here[key] and not no_task:
            differences.append(f"{key} is {shown(there.get(key))} there and {shown(here[key])} here")
    if differences:
        raise MmpError(
            f"{folder} holds a benchmark with other settings: {'; '.join(differences)}; "
            "give the same settings to continue it, or another folder (--out)"
        )
    old = _objects(there.get("planners"))
    labels = {planner.get("label") for planner in old}
    sources = grown_sources(known, own, folder)
    together = {
        **there,
        **columns_of(sources),
        "planners": [*old, *(planner for planner in here["planners"] if planner["label"] not in labels)],
        "task": there.get("task") or here["task"],
        "count": larger_count(there.get("count"), here["count"], known, own),
    }
    units = _units(together["count"], together["sources"], together["planners"])
    if units > MOST_UNITS:
        raise MmpError(
            f"with what is in {folder}, this makes {units} units; a benchmark has at most {MOST_UNITS}; give another "
            "folder (--out)"
        )
    return together


def larger_count(
    there: int | None, here: int | None, known: Sequence[KnownSource], own: Sequence[KnownSource]
) -> int | None:
    """Returns the larger of two counts. None means all of the files of that side, or `DRAWN_COUNT` drawn ones."""
    if there == here:
        return here
    return max(_count(there, known), _count(here, own))


def _count(count: int | None, sources: Sequence[KnownSource]) -> int:
    if count is not None:
        return count
    return max(
        DRAWN_COUNT if any(name.endswith("/") for name in source.names) else len(source.names) for source in sources
    )


def _changed_planners(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """Compares planners of the same label."""
    old, new = ({one.get("label"): one for one in _objects(side.get("planners"))} for side in (there, here))
    both = [label for label in new if label in old]
    others = [label for label in both if old[label].get("name") != new[label].get("name")]
    if others:
        return [f"planners are {_words(old, others)} there and {_words(new, others)} here"]
    return [
        f"options of {_word(new[label])} are {_options(old[label])} there and {_options(new[label])} here"
        for label in both
        if old[label].get("options") != new[label].get("options")
    ]


def _words(planners: Mapping[Any, Mapping[str, Any]], labels: Sequence[Any]) -> str:
    return ", ".join(_word(planners[label]) for label in labels)


def _word(planner: Mapping[str, Any]) -> str:
    """Returns the planner as `--planners` writes it."""
    label, name = planner.get("label"), planner.get("name")
    return f"{label}" if label == name else f"{label}={name}"


def _options(planner: Mapping[str, Any]) -> str:
    options = planner.get("options")
    if not options:
        return "the defaults"
    return (
        ", ".join(f"{k}={json.dumps(v)}" for k, v in options.items()) if isinstance(options, dict) else shown(options)
    )


def _texts(value: Any) -> list[str]:
    return [str(item) for item in value] if isinstance(value, list) else []


def _objects(value: Any) -> Sequence[Mapping[str, Any]]:
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []
