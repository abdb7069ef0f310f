"""When the children of a node are replanned, and what the low level is given to begin with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.node import Node
from mmp_planners.planning_context import Path


@runtime_checkable
class Expansion(Protocol):
    """Takes a child that is made but not replanned; `replan` does that and puts it where it belongs."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None: ...


@dataclass(frozen=True)
class EagerExpansion:
    """CBS as ever: each child is replanned when its parent is expanded."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None:
        replan(child)


@dataclass(frozen=True)
class LazyExpansion:
    """Lazy by one step: a child waits in OPEN with its parent's paths, and is replanned when it is first taken."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None:
        open_nodes.append(child)


@runtime_checkable
class Experience(Protocol):
    """Which path of the parent the low level begins with, if any."""

    def __call__(self, before: Path) -> Path | None: ...


@dataclass(frozen=True)
class FromScratch:
    """The low level knows of no earlier path."""

    def __call__(self, before: Path) -> Path | None:
        return None


@dataclass(frozen=True)
class FromParent:
    """xECBS: the parent's path as far as it keeps the constraints of the child."""

    def __call__(self, before: Path) -> Path | None:
        return before
