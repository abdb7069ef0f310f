"""The one place that imports MuJoCo for simulation and pictures: where that fails for want of a library, it says which.

MuJoCo loads the OpenGL library that `MUJOCO_GL` names while it is imported; some versions fail there.
"""

from __future__ import annotations

import os

from mmp_env.errors import MmpError
from mmp_env.opengl import missing_library

try:
    import mujoco
except Exception as error:  # ImportError, AttributeError, OSError or RuntimeError, as the version and the library go
    asked_for = os.environ.get("MUJOCO_GL", "")
    lack = missing_library(asked_for)
    if lack is None:
        raise
    raise MmpError(f"MuJoCo cannot be imported with MUJOCO_GL={asked_for}: {lack}") from error

__all__ = ["mujoco"]
