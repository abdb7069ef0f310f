"""Whether there is a dm_control that works; what is wrong otherwise, in one sentence."""

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
"""labmaze, which dm_control needs, has none for this Python and newer ones."""
_BACKEND = "MUJOCO_GL"


@functools.cache
def require() -> None:
    """Raises `MmpError` where dm_control is missing, or does not get on with the MuJoCo that is here."""
    try:
        with _backend_chosen():
            from dm_control import mujoco
    except ImportError as error:
        raise MmpError(f"dm_control cannot be imported ({error}); {_how_to_get_it()}") from error
    try:
        # Some releases import well with a MuJoCo that they do not know, and fail at the first model.
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
    """Without a display, dm_control would settle for a library that needs one: it is told another for its import."""
    if asked_for() or has_display():
        yield
        return
    try:
        backend = offscreen_backend()
    except MmpError:  # nothing can be drawn; all the rest works
        backend = "disable"
    os.environ[_BACKEND] = backend
    try:
        yield
    finally:
        del os.environ[_BACKEND]
