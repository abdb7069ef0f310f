"""Which compiled variant of the native core is used: the best one that is built and that this processor runs.

`_core_v1` runs everywhere; `_core_v3` (AVX2) and `_core_v4` (AVX-512) exist on x86-64. All give the same results to the
last bit. The environment variable `MMP_CORE` = v1, v3 or v4 asks for one of them.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
from types import ModuleType

from mmp_env.errors import MmpError, UnknownNameError

_NAMES = ("v1", "v3", "v4")


def _built(name: str) -> bool:
    return importlib.util.find_spec(f"mmp_env._core_{name}") is not None


def load(name: str) -> ModuleType:
    """The variant `name`, one of `usable()`."""
    return importlib.import_module(f"mmp_env._core_{name}")


def usable() -> list[str]:
    """The variants that are built and that this processor runs, best last. ImportError when none is built."""
    built = [name for name in _NAMES if _built(name)]
    if not built:
        raise ImportError(
            "the native core is not built: run `pip install .` in the sources of mmp-env, or scripts/build_core.sh"
        )
    level = load(built[0]).cpu_level()
    return [name for name in built if int(name.removeprefix("v")) <= level]


def preferred() -> str:
    """What `MMP_CORE` asks for, the best usable variant otherwise; MmpError when that does not run here."""
    names = usable()
    wanted = os.environ.get("MMP_CORE") or names[-1]
    if wanted in names:
        return wanted
    if wanted in _NAMES:
        raise MmpError(f"MMP_CORE={wanted} does not run on this processor, or is not built; usable: {', '.join(names)}")
    raise UnknownNameError("MMP_CORE", wanted, names)
