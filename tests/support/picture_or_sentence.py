"""Pictures in tests. On a machine without an OpenGL library the tests check the error message instead."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
import pytest

from mmp_env import opengl
from mmp_env.errors import MmpError
from mmp_env.sim.arm_colors import arm_color

T = TypeVar("T")
NONE_HERE = r"apt install|MUJOCO_GL"
"""Words of the error message."""


def made(call: Callable[[], T]) -> T | None:
    """Returns the result of `call`, or None if no picture can be made here and the error says what to install."""
    try:
        opengl.offscreen_backend()
    except MmpError:
        with pytest.raises(MmpError, match=NONE_HERE):
            call()
        return None
    return call()


@contextmanager
def without_libraries(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Makes the machine appear to have neither an OpenGL library nor a display."""
    monkeypatch.setattr(opengl, "find_library", lambda name: None)
    monkeypatch.setattr(opengl.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL"):
        monkeypatch.delenv(name, raising=False)
    opengl.found.cache_clear()
    try:
        yield
    finally:
        opengl.found.cache_clear()


def pixels_of_arm(image: np.ndarray, number: int) -> int:
    """Returns the number of pixels with the hue of that arm's colour, in light or shade."""
    pixels = image.reshape(-1, 3) / np.maximum(np.linalg.norm(image.reshape(-1, 3), axis=1), 1)[:, None]
    color = np.array(arm_color(number))
    return int((pixels @ (color / np.linalg.norm(color)) > 0.995).sum())
