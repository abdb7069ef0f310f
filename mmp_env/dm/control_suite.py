"""Check that dm_control works; otherwise one sentence says what is wrong."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
from collections.abc import Iterator

from mmp_env.errors import MmpError
from mmp_env.opengl import asked_for, has_display, offscreen_backend

INSTALL = "pip install 'mmp-env[dm]'"
NO_WHEELS_FROM = (3, 13)
"""First Python version without wheels of labmaze, which dm_control needs."""
_BACKEND = "MUJOCO_GL"


@functools.cache
def require() -> None:
    """Raises `MmpError` if dm_control is missing or does not work with the installed MuJoCo."""
    try:
        with _backend_chosen():
            from dm_control import mujoco
    except ImportError as error:
        raise MmpError(f"dm_control cannot be imported ({error}); {_how_to_get_it()}") from error
    try:
        # Some releases import with an unknown MuJoCo, and fail at the first model.
        mujoco.Physics.from_xml_string("<mujoco/>")
    except AttributeError as error:
        version = mujoco.wrapper.mujoco.__version__
        raise MmpError(
            f"this dm_control does not work with MuJoCo {version} ({error}); versions that do come with: {INSTALL}"
        ) from error


def _how_to_get_it() -> str:
    if sys.version_info >= NO_WHEELS_FROM:
        return f"it needs Python 3.11 or 3.12, and there: {INSTALL}"
    return f"get it with: {INSTALL}"


@contextlib.contextmanager
def _backend_chosen() -> Iterator[None]:
    """Sets `MUJOCO_GL` for the import of dm_control, which otherwise chooses a library that needs a display."""
    if asked_for() or has_display():
        yield
        return
    try:
        backend = offscreen_backend()
    except MmpError:  # pictures are not possible; everything else works
        backend = "disable"
    os.environ[_BACKEND] = backend
    try:
        yield
    finally:
        del os.environ[_BACKEND]
