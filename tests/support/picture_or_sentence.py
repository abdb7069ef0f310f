"""Pictures in tests: on a machine without an OpenGL library there is a sentence instead, and that is tested."""

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
"""What the sentence has in it."""


def made(call: Callable[[], T]) -> T | None:
    """Returns what `call` makes; None where no picture can be made here, and `call` has said so and what to install."""
    try:
        opengl.offscreen_backend()
    except MmpError:
        with pytest.raises(MmpError, match=NONE_HERE):
            call()
        return None
    return call()


@contextmanager
def without_libraries(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Returns a machine with neither an OpenGL library nor a display."""
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
    """Returns how many pixels have the hue of that arm's colour, be they lit or in the shade."""
    pixels = image.reshape(-1, 3) / np.maximum(np.linalg.norm(image.reshape(-1, 3), axis=1), 1)[:, None]
    color = np.array(arm_color(number))
    return int((pixels @ (color / np.linalg.norm(color)) > 0.995).sum())
