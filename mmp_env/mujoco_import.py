"""The only import of MuJoCo. If a library is missing, the error names it.

MuJoCo loads the OpenGL library that `MUJOCO_GL` names while it is imported; some versions fail there.
"""

from __future__ import annotations

import contextlib
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

__all__ = ["mujoco", "without_log"]

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
