"""Nonsense in the options of a command line. It shares no code with the program."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from typing import Any

from fuzz import goal_validator, known_keys
from fuzz.json_values import numbers_of
from fuzz.known_keys import unknown_keys

OPTIONS = {
    **dict.fromkeys(("--time-limit", "--rate", "--max-velocity", "--max-acceleration", "--max-jerk", "--margin"), 0.0),
    **dict.fromkeys(("--tolerance", "--improve", "--delays"), 0.0),
    **dict.fromkeys(("--count", "--workers", "--memory-limit"), 1.0),
    "--seed": 0.0,
}
"""Option -> its least value; those with 0.0 of a number that is not whole must be larger."""
WHOLE = ("--seed", "--count", "--workers", "--memory-limit")
CHOICES = {
    "--format": ("npz", "minari"),
    "--control-mode": ("position", "velocity", "delta"),
    "--robot": ("ur5e", "panda", "fr5", "piper"),
    "--task": ("reach", "crossing", "parallel", "pick", "place", "packing"),
    "--planner": (
        *("auto", "group-rrt", "rrt-connect", "prioritized", "apf-ecbs", "apf-ecbs-nf", "ecbs", "gen-ecbs", "xecbs"),
        *("cbs", "cbs-mp"),
    ),
}
"""Option -> its words."""
NAMED_GOALS = {"--start": ("home", "tucked"), "--goal": ("home", "tucked", "stay"), "--keep": ()}
"""Option -> words in place of a configuration or a bound."""
COUNTS = {
    **dict.fromkeys(("shorten", "shortcuts", "improve", "rounds", "replan", "halvings"), 0),
    **dict.fromkeys(("iterations", "max_iterations", "patience", "most", "nodes"), 1),
}
"""Whole option of a planner -> its least value."""
LEAST = {
    "w": 1.0,
    "until": 1.0,
    "pad_growth": 1.0,
    **dict.fromkeys(("wait", "floor", "cap", "stretch", "exact_within"), 0.0),
}
"""Option of a planner -> its least value."""
ABOVE_0 = ("dt", "eta", "pad", "radius", "sphere_radius", "alpha", "k_rep", "d0", "step_rad", "range")
"""Options of planners that must be larger than 0. A `step` may be such a number, or a word."""
SWITCHES = ("restarts", "direct", "early_stop", "last_resort", "parked_yield", "shorten_paths", "static_tree", "trace")
SETTING_WORDS = {
    "preset": ("ours", "paper"),
    "bound": ("paths", "straight"),
    "conflict_choice": ("alternating", "earliest"),
    "constraint": ("avoid-state", "vertex", "avoid-path", "sphere", "priority", "priority-path", "split"),
    "distance": ("surface", "centre"),
    "step": ("normalised", "gradient"),
    "waits": ("removed", "kept"),
    "repulsion": ("off", "paths", "fast-track"),
    "fast_track": ("sound", "literal"),
    "fast_track_at": ("generation", "expansion"),
    "critical_arms": ("all", "cover", "one"),
    "misses": ("kept", "discarded"),
}
"""Option of a planner -> its words."""


def option_nonsense(line: list[str]) -> list[str]:
    """Returns why no program may accept the values of a command line's options."""
    return [f"{option} {word}" for option, word in itertools.pairwise(line) if _is_nonsense(option, word)]


def _is_nonsense(option: str, word: str) -> bool:
    if option in OPTIONS:
        return not all(_is_in_range(option, part.rpartition("=")[2]) for part in word.split(","))
    if option in CHOICES:
        return word not in CHOICES[option]
    if option == "--set":
        key, _, value = word.partition("=")
        return not _is_setting(key.rpartition(".")[2].replace("-", "_"), value)
    return option in NAMED_GOALS and not word.startswith("@") and not _is_goal(option, word)


def _is_in_range(option: str, text: str) -> bool:
    try:
        number = int(text) if option in WHOLE else float(text)
    except ValueError:
        return False
    if option == "--time-limit" and number == math.inf:
        return True
    least = OPTIONS[option]
    return least <= number < math.inf and (option in WHOLE or number > least)


def _is_setting(key: str, text: str) -> bool:
    """Returns whether an option of a planner may have a value. Those that are in no table are unknown."""
    if key in SWITCHES:
        return text in ("on", "off", "true", "false")
    if key == "kinds" or text in SETTING_WORDS.get(key, ()):
        return True
    try:
        number = float(text)
    except ValueError:
        return False
    if key in COUNTS:
        return number.is_integer() and number >= COUNTS[key]
    above_0 = key == "step" or key in ABOVE_0
    return math.isfinite(number) and (number > 0 if above_0 else key in LEAST and number >= LEAST[key])


def _is_goal(option: str, word: str) -> bool:
    """Returns whether a word may be a configuration, a goal or a bound, of one arm or of all."""
    table: dict[str, Any] = known_keys.OPTIONS[option]
    are_all = word[:1] == "{"
    if word[:1] in ("{", "["):
        table = {known_keys.ARM: table}
    elif "=" in word:
        word = word.partition("=")[2]
        if word.startswith("@"):
            return True
    try:
        value = json.loads(word)
        numbers_of(value)
    except (ValueError, RecursionError):
        return word in NAMED_GOALS[option]
    if isinstance(value, dict | list):
        return not any(unknown_keys(value, table, set())) and not any(
            _form_nonsense(option, list(value.values()) if are_all and isinstance(value, dict) else [value])
        )
    return isinstance(value, str) and value in NAMED_GOALS[option]


def _form_nonsense(option: str, given: list[Any]) -> Iterator[str]:
    """Yields why no program may accept the goals or the bounds that an option gives to arms."""
    for item in given:
        if option == "--keep":
            yield from goal_validator.bound_nonsense(item)
        else:
            yield from goal_validator.goal_nonsense(item, None, is_start=option == "--start")
