"""Finds the folder of a robot or tool: built in, of an installed package, in the user's data folder, or at a path."""

from __future__ import annotations

import os
from importlib.metadata import entry_points
from pathlib import Path

GROUP = "mmp_env.robots"
"""Entry points of packages that bring robots: the name of a robot and the path of its folder, text or `Path`."""
DESCRIPTION, TOOL_DESCRIPTION = "robot.json", "tool.json"
_BUILT_IN, _TOOLS = (Path(__file__).parent / folder for folder in ("robots", "tools"))


def user_folder() -> Path:
    """Returns the folder of the robots that the user added: `mmp-env/robots` in `XDG_DATA_HOME`."""
    return _base("XDG_DATA_HOME", ".local/share") / "mmp-env" / "robots"


def cache_folder() -> Path:
    """Returns the folder of earlier imports: `mmp-env/robots` in `XDG_CACHE_HOME`."""
    return _base("XDG_CACHE_HOME", ".cache") / "mmp-env" / "robots"


def mesh_cache_folder() -> Path:
    """Returns the folder of the pieces of mesh files that were read earlier: `mmp-env/meshes` in `XDG_CACHE_HOME`."""
    return _base("XDG_CACHE_HOME", ".cache") / "mmp-env" / "meshes"


def is_path(name: str) -> bool:
    """Returns whether a robot is given by the path of its folder rather than by its name."""
    return "/" in name


def robot_names() -> list[str]:
    """Returns the names of all robots, sorted."""
    names = {point.name for point in entry_points(group=GROUP)}
    for folder in (_BUILT_IN, user_folder()):
        try:
            names |= {path.parent.name for path in folder.glob(f"*/{DESCRIPTION}")}
        except OSError:  # a folder that cannot be read holds no robot
            continue
    return sorted(names)


def find_robot(name: str) -> Path | None:
    """Returns the folder of the robot of that name or at that path, or None where there is none.

    A built-in robot cannot be replaced. One of a package comes before one that the user added.
    """
    if is_path(name):
        return _holding(Path(name))
    if name in ("", ".", ".."):
        return None
    return _holding(_BUILT_IN / name) or _of_package(name) or _holding(user_folder() / name)


def tool_names() -> list[str]:
    """Returns the names of all tools, sorted."""
    return sorted(path.parent.name for path in _TOOLS.glob(f"*/{TOOL_DESCRIPTION}"))


def find_tool(name: str) -> Path | None:
    """Returns the folder of the tool of that name, or None where there is none."""
    return _TOOLS / name if name in tool_names() else None


def is_built_in(folder: Path) -> bool:
    """Returns whether the folder of a robot or tool is one of this package."""
    return folder.parent in (_BUILT_IN, _TOOLS)


def is_built_in_robot(name: str) -> bool:
    """Returns whether a name is that of a built-in robot."""
    return (_BUILT_IN / name / DESCRIPTION).is_file()


def is_built_in_tool(name: str) -> bool:
    """Returns whether a name is that of a built-in tool."""
    return (_TOOLS / name / TOOL_DESCRIPTION).is_file()


def _of_package(name: str) -> Path | None:
    for point in entry_points(group=GROUP, name=name):
        try:
            found = point.load()
        except Exception:  # a stranger's module may raise anything while it is imported
            continue
        if isinstance(found, str | os.PathLike) and (folder := _holding(Path(found))):
            return folder
    return None


def _holding(folder: Path) -> Path | None:
    try:
        return folder if (folder / DESCRIPTION).is_file() else None
    except (OSError, ValueError):
        return None


def _base(variable: str, home: str) -> Path:
    """A base directory of the XDG specification; relative values of the variable are ignored, as it says."""
    given = os.environ.get(variable, "")
    return Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~")) / home
