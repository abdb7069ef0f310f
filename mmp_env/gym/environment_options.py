"""Checks of the options of an environment, in Gymnasium and in dm_control."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mmp_env.argument_checks import flag, number, refused, text, whole
from mmp_env.opengl import MAX_PIXELS


def check_options(options: Mapping[str, object]) -> None:
    """Raises `MmpError` for an option whose value has the wrong type or is out of range.

    `InstanceSource` checks `max_velocity` and `margin`; `steps_per_action` checks that the control rate divides the
    physics rate.
    """
    for name, value in options.items():
        _CHECKS[name](name, value)


def _optional_text(name: str, value: object) -> None:
    if value is not None:
        text(name, value)


def _sphere_set(name: str, value: object) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, str | int | np.integer)):
        raise refused(name, value, "the name of a sphere set, '28', 'fine' or 'exact'")


def _pixels(name: str, value: object) -> None:
    whole(name, value, 1, MAX_PIXELS)


def _rate(name: str, value: object) -> None:
    number(name, value, "a finite number of actions a second, above 0")


def _seconds(name: str, value: object) -> None:
    number(name, value, "a number of seconds above 0, inf for none", infinite=True)


_CHECKS: dict[str, Callable[[str, object], object]] = {
    "robot": _optional_text,
    "spheres": _sphere_set,
    "control_mode": text,
    "terminate_on_contact": flag,
    "self_contacts": flag,
    "control_rate_hz": _rate,
    "width": _pixels,
    "height": _pixels,
    "time_limit": _seconds,
}
