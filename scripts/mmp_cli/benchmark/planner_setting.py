"""`--set [planner.]key=value`: an option of one planner of a benchmark, or of all."""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

from mmp_cli.arguments import setting


class PlannerSetting(NamedTuple):
    """One `--set`; without a label it is for all planners."""

    label: str | None
    key: str
    value: Any


def planner_setting(text: str) -> PlannerSetting:
    """`key=value` or `planner.key=value`."""
    left, equals, value = text.partition("=")
    label, dot, key = left.rpartition(".")
    if not (key and equals) or (dot and not label):
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form [planner.]key=value")
    return PlannerSetting(label if dot else None, *setting(key + equals + value))
