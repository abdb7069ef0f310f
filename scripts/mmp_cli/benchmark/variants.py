"""`--planners a,label=b`: which planners a benchmark runs, and with what options."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from mmp_cli.benchmark.job import Variant
from mmp_cli.benchmark.planner_setting import PlannerSetting
from mmp_env.errors import MmpError, UnknownNameError

_LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def read_variants(planners: str, settings: Sequence[PlannerSetting]) -> dict[str, Variant]:
    """Label -> planner with options. Raises `MmpError`; whether the planners have those options is not looked at."""
    import mmp_planners

    known = mmp_planners.names()
    names = dict(_labelled(planners.split(","), known))
    for one in settings:
        if one.label is not None and one.label not in names:
            raise UnknownNameError("planner of this benchmark in --set", one.label, names)
    general = _options(one for one in settings if one.label is None)
    return {
        label: Variant(
            label=label, name=name, options=general | _options(one for one in settings if one.label == label)
        )
        for label, name in names.items()
    }


def _labelled(words: Iterable[str], known: Sequence[str]) -> Iterable[tuple[str, str]]:
    seen = set()
    for word in words:
        label, equals, name = word.strip().partition("=")
        name = name if equals else label
        if name not in known:
            raise UnknownNameError("planner", name, known)
        if equals and label in known and label != name:
            raise MmpError(f"--planners calls {name} '{label}', which is another planner's name; take another label")
        if not _LABEL.fullmatch(label):
            raise MmpError(f"--planners has the label '{label}'; it must be letters, digits, '.', '_' and '-'")
        if label in seen:
            raise MmpError(f"--planners has '{label}' twice; give one of them a label, such as other={name}")
        seen.add(label)
        yield label, name


def _options(settings: Iterable[PlannerSetting]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for label, key, value in settings:
        if key in out:
            whole = f"{label}.{key}" if label else key
            raise MmpError(f"--set gives {whole} twice, {out[key]} and {value}; give one")
        out[key] = value
    return out
