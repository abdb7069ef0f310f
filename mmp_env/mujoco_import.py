"""The only import of MuJoCo. If a library is missing, the error names it.

MuJoCo loads the OpenGL library that `MUJOCO_GL` names while it is imported; some versions fail there.
"""

from __future__ import annotations

from mmp_env.opengl import asked_for, silent_children

try:
    with silent_children():
        import mujoco
except Exception:  # ImportError, AttributeError, OSError or RuntimeError, as the version and the library go
    asked_for()
    raise

__all__ = ["mujoco"]
