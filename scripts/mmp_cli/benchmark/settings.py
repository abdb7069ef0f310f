"""settings.json: the settings of a folder of results, which a second start must repeat."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mmp_cli.benchmark.job import Job
from mmp_cli.benchmark.sources import Drawn
from mmp_cli.machine import version
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.files.reading import Location, check_schema, read_document
from mmp_env.files.writing import json_text, plain, write_text
from mmp_env.wording import shown

SETTINGS = "settings.json"
SCHEMA = "mmp-bench/1"


def settings_of(args: Namespace, job: Job) -> dict[str, Any]:
    """Returns all settings that results depend on, as JSON values; workers, cluster and folder are not among them."""
    drawn = [source for source in job.sources if isinstance(source, Drawn)]
    return plain(
        {
            "schema": SCHEMA,
            "sources": list(args.sources),
            "digests": [source.digest for source in job.sources],
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
    check_schema(data, SCHEMA, Location(str(path)))
    return data


def save_settings(settings: Mapping[str, Any], folder: Path) -> None:
    """Writes the settings. Raises `MmpError` if that fails."""
    write_text(folder / SETTINGS, json_text(settings))


def check_same(there: Mapping[str, Any], here: Mapping[str, Any], folder: Path) -> None:
    """Raises `MmpError` that names the settings that differ."""
    differences = [*_sources(there, here), *_planners(there, here)]
    for key in here:
        if key not in ("sources", "digests", "planners") and there.get(key) != here[key]:
            differences.append(f"{key} is {shown(there.get(key))} there and {shown(here[key])} here")
    if differences:
        raise MmpError(
            f"{folder} holds a benchmark with other settings: {'; '.join(differences)}; "
            "give the same settings to continue it, or another folder (--out)"
        )


def _sources(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """Compares sources by content: another path to the same file makes no difference."""
    old, new = _texts(there.get("digests")), _texts(here["digests"])
    if sorted(old) == sorted(new):
        return []
    names = _texts(there.get("sources"))
    if sorted(names) != sorted(here["sources"]):
        return [f"sources are {', '.join(names)} there and {', '.join(here['sources'])} here"]
    changed = [name for name, digest in zip(here["sources"], new, strict=True) if digest not in old]
    return [f"the cell or the instances of {', '.join(changed)} are not what they were"]


def _planners(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    old, new = ({_word(one): one for one in _objects(side.get("planners"))} for side in (there, here))
    if old.keys() != new.keys():
        return [f"planners are {', '.join(old)} there and {', '.join(new)} here"]
    return [
        f"options of {word} are {_options(old[word])} there and {_options(new[word])} here"
        for word in new
        if old[word].get("options") != new[word].get("options")
    ]


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
