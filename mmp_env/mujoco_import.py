"""The only import of MuJoCo. If a library is missing, the error names it.

MuJoCo loads the OpenGL library that `MUJOCO_GL` names while it is imported; some versions fail there.
"""

from __future__ import annotations

import contextlib
import os
import threading
import warnings
from collections.abc import Iterator

from mmp_env.opengl import asked_for, silent_children

try:
    with silent_children():
        import mujoco
except Exception:  # ImportError, AttributeError, OSError or RuntimeError, as the version and the library go
    asked_for()
    raise

__all__ = ["mujoco", "without_log", "without_report"]

_LOG = threading.RLock()
"""Held while MuJoCo's handler of warnings and Python's filters, which all threads share, are other ones."""


@contextlib.contextmanager
def without_log() -> Iterator[None]:
    """Drops MuJoCo's warnings, which would be in a file in the working directory, or printed by Python."""
    with _LOG, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda text: None)
        try:
            yield
        finally:
            mujoco.set_mju_user_warning(before)


@contextlib.contextmanager
def without_report(*, beside_threads: bool) -> Iterator[None]:
    """Drops the report that MuJoCo's Qhull writes past Python's streams about a mesh without a hull.

    Args:
        beside_threads: whether to do so while other threads run; what they write to standard error meanwhile is lost.
    """
    with _LOG:
        kept = None
        with contextlib.suppress(OSError):  # there may be no standard error
            kept = os.dup(2) if beside_threads or threading.active_count() == 1 else None
        if kept is None:
            yield
            return
        try:
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
