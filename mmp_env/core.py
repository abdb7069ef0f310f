"""The native core: compiled kinematics, clearance, proofs and searches. Only this module imports the compiled code.

The core is compiled for several processor levels: `_core_v1` runs everywhere, `_core_v3` (AVX2) and `_core_v4`
(AVX-512) exist on x86-64. This module takes the names of the best variant that is built and runs here; their types
stand in `_core.pyi`. All variants give the same results to the last bit. The environment variable `MMP_CORE` (v1, v3
or v4) chooses one.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
from types import ModuleType
from typing import TYPE_CHECKING

from mmp_env.errors import MmpError, UnknownNameError

_VARIANTS = ("v1", "v3", "v4")


def _built(name: str) -> bool:
    return importlib.util.find_spec(f"mmp_env._core_{name}") is not None


def load_variant(name: str) -> ModuleType:
    """Returns the compiled module of a variant, one of `usable_variants()`."""
    return importlib.import_module(f"mmp_env._core_{name}")


def usable_variants() -> list[str]:
    """Returns the variants that are built and that this processor runs, the best one last.

    Raises:
        ImportError: No variant is built.
    """
    built = [name for name in _VARIANTS if _built(name)]
    if not built:
        raise ImportError(
            "the native core is not built: run `pip install .` in the sources of mmp-env, or scripts/build_core.sh"
        )
    level = load_variant(built[0]).cpu_level()
    return [name for name in built if int(name.removeprefix("v")) <= level]


def preferred_variant() -> str:
    """Returns the variant that `MMP_CORE` asks for, or the best usable one.

    Raises:
        MmpError: The variant that `MMP_CORE` asks for is unknown, is not built, or does not run on this processor.
    """
    names = usable_variants()
    wanted = os.environ.get("MMP_CORE") or names[-1]
    if wanted in names:
        return wanted
    if wanted in _VARIANTS:
        raise MmpError(f"MMP_CORE={wanted} does not run on this processor, or is not built; usable: {', '.join(names)}")
    raise UnknownNameError("MMP_CORE", wanted, names)


if TYPE_CHECKING:
    from mmp_env._core import *  # noqa: F403
else:
    _chosen = vars(load_variant(preferred_variant()))
    globals().update({name: value for name, value in _chosen.items() if not name.startswith("_")})
