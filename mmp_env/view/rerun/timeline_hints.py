"""A line at the top of each tab that says which timeline to choose: rerun has one timeline for all tabs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.sdk import require

_ROOT = "/timeline_hint"


def hint_path(tab: str) -> str:
    """Entity of the text of a tab."""
    return f"{_ROOT}/{tab.lower()}"


def send_timeline_hints(stream: Any, tabs: Mapping[str, str]) -> None:
    """Logs the text of each tab, name -> timeline, on every timeline of these, so that it fits the chosen one."""
    rerun = require()
    if len(tabs) == 1:
        return
    for chosen in tabs.values():
        if chosen == timelines.PLAN_TIME:
            stream.set_time(chosen, duration=0.0)
        else:
            stream.set_time(chosen, sequence=0)
        for tab, own in tabs.items():
            stream.log(hint_path(tab), rerun.TextDocument(hint(tab, own, chosen), media_type="text/markdown"))
        stream.reset_time()


def hint(tab: str, own: str, chosen: str) -> str:
    """The text of a tab whose timeline is `own` while the timeline `chosen` is chosen, as Markdown."""
    if own == chosen:
        return f"{tab} follows the timeline `{own}`, which is chosen."
    return f"**Choose the timeline `{own}` at the bottom left, where it says `{chosen}`: {tab} follows that one.**"
