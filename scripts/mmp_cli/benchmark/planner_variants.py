"""`--planners a,label=b` and `--set [planner.]key=value`: planners of a benchmark with their options."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mmp_cli.arguments import setting
from mmp_env.errors import MmpError, UnknownNameError

_LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A planner with options and a label, which by default is its name."""

    label: str
    name: str
    options: Mapping[str, Any] = field(default_factory=dict)


class PlannerSetting(NamedTuple):
    """One `--set`; without a label it holds for all planners."""

    label: str | None
    key: str
    value: Any


def planner_setting(text: str) -> PlannerSetting:
    """Returns the setting in `key=value` or `planner.key=value`."""
    left, equals, value = text.partition("=")
    label, dot, key = left.rpartition(".")
    if not (key and equals) or (dot and not label):
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form [planner.]key=value")
    return PlannerSetting(label if dot else None, *setting(key + equals + value))


def read_variants(planners: str, settings: Sequence[PlannerSetting]) -> dict[str, Variant]:
    """Returns label -> planner with options. Raises `MmpError`. It does not check the names of options."""
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
            raise MmpError(f"--planners calls {name} '{label}', which is another planner's name; choose another label")
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
