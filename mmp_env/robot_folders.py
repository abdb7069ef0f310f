"""Finds the folder of a robot or tool: built in, of an installed package, in the user's data folder, or at a path."""

from __future__ import annotations

import os
from importlib.metadata import entry_points
from pathlib import Path

GROUP, TOOL_GROUP = "mmp_env.robots", "mmp_env.tools"
"""Entry points of packages that bring robots or tools: its name and the path of its folder, text or `Path`."""
DESCRIPTION, TOOL_DESCRIPTION = "robot.json", "tool.json"
_BUILT_IN, _TOOLS = (Path(__file__).parent / folder for folder in ("robots", "tools"))


def user_folder() -> Path:
    """Returns the folder of the robots that the user added: `mmp-env/robots` in `XDG_DATA_HOME`."""
    return _base("XDG_DATA_HOME", ".local/share") / "mmp-env" / "robots"


def user_tool_folder() -> Path:
    """Returns the folder of the tools that the user added: `mmp-env/tools` in `XDG_DATA_HOME`."""
    return _base("XDG_DATA_HOME", ".local/share") / "mmp-env" / "tools"


def tool_cache_folder() -> Path:
    """Returns the folder of earlier imports of tools: `mmp-env/tools` in `XDG_CACHE_HOME`."""
    return _base("XDG_CACHE_HOME", ".cache") / "mmp-env" / "tools"


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
    return _names(GROUP, DESCRIPTION, (_BUILT_IN, user_folder()))


def find_robot(name: str) -> Path | None:
    """Returns the folder of the robot of that name or at that path, or None where there is none.

    A built-in robot cannot be replaced. One of a package comes before one that the user added.
    """
    return _found(name, GROUP, DESCRIPTION, (_BUILT_IN, user_folder()))


def tool_names() -> list[str]:
    """Returns the names of all tools, sorted."""
    return _names(TOOL_GROUP, TOOL_DESCRIPTION, (_TOOLS, user_tool_folder()))


def find_tool(name: str) -> Path | None:
    """Returns the folder of the tool of that name or at that path, see `find_robot`."""
    return _found(name, TOOL_GROUP, TOOL_DESCRIPTION, (_TOOLS, user_tool_folder()))


def is_built_in(folder: Path) -> bool:
    """Returns whether the folder of a robot or tool is one of this package."""
    return folder.parent in (_BUILT_IN, _TOOLS)


def is_built_in_robot(name: str) -> bool:
    """Returns whether a name is that of a built-in robot."""
    return (_BUILT_IN / name / DESCRIPTION).is_file()


def is_built_in_tool(name: str) -> bool:
    """Returns whether a name is that of a built-in tool."""
    return (_TOOLS / name / TOOL_DESCRIPTION).is_file()


def _names(group: str, description: str, folders: tuple[Path, Path]) -> list[str]:
    names = {point.name for point in entry_points(group=group)}
    for folder in folders:
        try:
            names |= {path.parent.name for path in folder.glob(f"*/{description}")}
        except OSError:  # a folder that cannot be read holds nothing
            continue
    return sorted(names)


def _found(name: str, group: str, description: str, folders: tuple[Path, Path]) -> Path | None:
    if is_path(name):
        return _holding(Path(name), description)
    if name in ("", ".", ".."):
        return None
    built_in, added = (_holding(folder / name, description) for folder in folders)
    return built_in or _of_package(name, group, description) or added


def _of_package(name: str, group: str, description: str) -> Path | None:
    for point in entry_points(group=group, name=name):
        try:
            found = point.load()
        except Exception:  # a stranger's module may raise anything while it is imported
            continue
        if isinstance(found, str | os.PathLike) and (folder := _holding(Path(found), description)):
            return folder
    return None


def _holding(folder: Path, description: str) -> Path | None:
    try:
        return folder if (folder / description).is_file() else None
    except (OSError, ValueError):
        return None


def _base(variable: str, home: str) -> Path:
    """A base directory of the XDG specification; relative values of the variable are ignored, as it says."""
    given = os.environ.get(variable, "")
    return Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~")) / home
