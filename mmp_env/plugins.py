"""Plug-ins: planners and tasks of any installed package, found by the entry points of their group."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from mmp_env.errors import MmpError, UnknownNameError, in_words


@dataclass(frozen=True, kw_only=True)
class PluginGroup:
    """The plug-ins of one kind. No package can replace a built-in name; two other packages with one name are an error.

    Attributes:
        kind: name of the kind in messages, such as `planner`.
        group: entry-point group.
        package: the built-in package.
    """

    kind: str
    group: str
    package: str

    def names(self) -> list[str]:
        """Returns the names of all plug-ins, sorted, without importing them."""
        return sorted(self._points())

    def point(self, name: str) -> EntryPoint:
        """Returns the entry point of a name, without importing it.

        Raises:
            UnknownNameError: if no package has the name.
            MmpError: if two packages have it.
        """
        points = self._points()
        if name not in points:
            raise UnknownNameError(self.kind, name, points)
        first, *others = points[name]
        if others:
            both = f"{_source(first)} and {_source(others[0])}"
            raise MmpError(f"two packages have a {self.kind} '{name}': {both}; remove one of them")
        return first

    def is_foreign(self, name: str) -> bool:
        """Returns whether the plug-in comes from another package than the built-in one. Raises like `point`."""
        return not self._is_ours(self.point(name))

    def load(self, name: str) -> Any:
        """Returns the object that the entry point names. Raises like `point`, and `MmpError` if it does not load."""
        point = self.point(name)
        try:
            return point.load()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # another package's module may raise anything on import
            raise MmpError(f"{self.whose(name)} does not load: {in_words(error)}") from error

    def whose(self, name: str) -> str:
        """Returns the plug-in and its location for messages: `planner 'x' (package.module:Class)`."""
        return f"{self.kind} '{name}' ({self.point(name).value})"

    def _points(self) -> dict[str, list[EntryPoint]]:
        """Returns name -> its entry points: the built-in one, or all others that differ."""
        points: dict[str, list[EntryPoint]] = {}
        for point in _found(entry_points, self.group, _installed()):
            same = points.setdefault(point.name, [])
            if self._is_ours(point):
                same[:] = [point]
            elif point not in same and not (same and self._is_ours(same[0])):
                same.append(point)
        return points

    def _is_ours(self, point: EntryPoint) -> bool:
        return point.module.partition(".")[0] == self.package


PLANNERS = PluginGroup(kind="planner", group="mmp_env.planners", package="mmp_planners")
TASKS = PluginGroup(kind="task", group="mmp_env.tasks", package="mmp_tasks")


@functools.lru_cache(maxsize=16)
def _found(
    find: Callable[..., Iterable[EntryPoint]], group: str, installed: tuple[tuple[str, int], ...]
) -> tuple[EntryPoint, ...]:
    """Returns the entry points of a group. Reading takes milliseconds: they are kept while no folder changes."""
    return tuple(find(group=group))


def _installed() -> tuple[tuple[str, int], ...]:
    """Returns the folders of packages, each with the time of its last change [ns]."""
    folders = (folder or "." for folder in sys.path)
    return tuple((folder, os.stat(folder).st_mtime_ns) for folder in folders if os.path.exists(folder))


def _source(point: EntryPoint) -> str:
    package = point.dist.name if point.dist is not None else "an unnamed package"
    return f"{package} ({point.value})"
