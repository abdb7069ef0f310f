"""The timelines of a recording, and the text in each tab that says which timeline to choose.

Rerun has one current timeline for all tabs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.view.rerun.sdk import require

LONGEST_S = 1e9
"""Longest plan in a recording [s]; its timelines count nanoseconds in 64 bits."""
EXPANSION = "expansion"
"""Timeline of the number of expanded nodes; 0 is the root before the search, the last value is the result."""
REPULSION = "repulsion"
"""Timeline of the iterations of ModifyMotion, numbered through over all paths that are shown."""
PLAN_TIME = "plan time"
"""Timeline of the seconds since the plan began."""
STEP = "step"
"""Timeline of the steps of an environment since its recording began; a reset counts as one."""
_HINTS = "/timeline_hint"


def check_duration(duration_s: float) -> None:
    """Raises `MmpError` if a plan is longer than a timeline can be."""
    if not duration_s <= LONGEST_S:
        raise MmpError(f"the plan takes {duration_s:.6g} s; a recording holds {LONGEST_S:g} s at most")


def sequence(timeline: str, numbers: Iterable[int]) -> Any:
    """Returns an index column of whole numbers."""
    return require().TimeColumn(timeline, sequence=list(numbers))


def seconds(times: Float[np.ndarray, "t"] | Sequence[float]) -> Any:
    """Returns an index column on `plan time` [s]."""
    return require().TimeColumn(PLAN_TIME, duration=np.asarray(times, dtype=float).tolist())


def hint_path(tab: str) -> str:
    """Returns the entity path of a tab's hint."""
    return f"{_HINTS}/{tab.lower()}"


def send_timeline_hints(stream: Any, tabs: Mapping[str, str]) -> None:
    """Logs the hint of each tab, name -> timeline, on each of these timelines, so that it fits the chosen one."""
    rerun = require()
    if len(tabs) == 1:
        return
    for chosen in tabs.values():
        if chosen == PLAN_TIME:
            stream.set_time(chosen, duration=0.0)
        else:
            stream.set_time(chosen, sequence=0)
        for tab, own in tabs.items():
            stream.log(hint_path(tab), rerun.TextDocument(hint(tab, own, chosen), media_type="text/markdown"))
        stream.reset_time()


def hint(tab: str, own: str, chosen: str) -> str:
    """Returns the hint, in Markdown, of a tab that follows the timeline `own` while `chosen` is the current one."""
    if own == chosen:
        return f"{tab} follows the timeline `{own}`, which is chosen."
    return f"**Choose the timeline `{own}` at the bottom left, where it says `{chosen}`: {tab} follows that one.**"
