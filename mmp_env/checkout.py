"""Replaces a checkout without a compiled core by the installed package.

Python looks for packages in the folder of its script, or in the current folder, before the installed packages. In a
checkout it therefore finds the sources, which cannot work without the native core. The installed package replaces them
as a whole, so that its modules, its core and the other packages are of one version.
"""

from __future__ import annotations

import filecmp
import importlib.util
import os
import sys
import warnings
from collections.abc import Iterable
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec
from pathlib import Path

_PACKAGE = "mmp_env"
_SOURCES = (_PACKAGE, "planners/mmp_planners", "tasks/mmp_tasks", "scripts/mmp_cli")
"""Folders of the packages in a checkout."""
_BUILT = {".so", ".pyc"}
"""Suffixes of built files, which no checkout tracks."""


def installed_package(folders: Iterable[str]) -> ModuleSpec | None:
    """Returns the installed package if the one in `folders` has no core and another on the path has one."""
    here = [os.path.realpath(folder) for folder in folders]
    if any(_has_core(folder) for folder in here):
        return None
    for entry in sys.path:
        folder = os.path.realpath(os.path.join(entry, _PACKAGE))
        init = os.path.join(folder, "__init__.py")
        if folder not in here and os.path.isfile(init) and _has_core(folder):
            return importlib.util.spec_from_file_location(_PACKAGE, init, submodule_search_locations=[folder])
    return None


def take_place(installed: ModuleSpec, checkout: Path) -> None:
    """Makes `import mmp_env` give the installed package. Warns if the checkout's sources differ from it."""
    for name in [name for name in sys.modules if name.startswith(f"{_PACKAGE}.")]:
        del sys.modules[name]
    module = importlib.util.module_from_spec(installed)
    sys.modules[_PACKAGE] = module
    assert installed.loader is not None
    installed.loader.exec_module(module)
    if any(_differs(checkout / source) for source in _SOURCES):
        warnings.warn(
            f"mmp_env is imported from {Path(module.__path__[0]).parent}, where it is installed, and the sources in "
            f"{checkout} differ from it: install them with scripts/demo.sh, or build their core with "
            "scripts/build_core.sh",
            RuntimeWarning,
            stacklevel=3,
        )


def _has_core(folder: str) -> bool:
    try:
        names = os.listdir(folder)
    except OSError:
        return False
    return any(n.startswith("_core_v") and n[n.find(".") :] in EXTENSION_SUFFIXES for n in names)


def _differs(source: Path) -> bool:
    """Returns whether a package's folder in the checkout differs from the package that Python imports."""
    spec = importlib.util.find_spec(source.name) if source.is_dir() else None
    if spec is None or spec.origin is None:
        return False
    installed = Path(spec.origin).parent
    names = _files(source)
    _, changed, unreadable = filecmp.cmpfiles(source, installed, names, shallow=False)
    return bool(changed or unreadable) or names != _files(installed)


def _files(folder: Path) -> list[str]:
    found = (path for path in folder.rglob("*") if path.suffix not in _BUILT and path.is_file())
    return sorted(str(path.relative_to(folder)) for path in found)
