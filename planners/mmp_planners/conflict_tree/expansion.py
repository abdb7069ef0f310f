"""When the children of a node are replanned, and which earlier path the low level begins with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.node import Node
from mmp_planners.planning_context import Path


@runtime_checkable
class Expansion(Protocol):
    """Takes a child that is not replanned yet; `replan` plans it and puts it into the open list."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None: ...


@dataclass(frozen=True)
class EagerExpansion:
    """Replans each child when its parent is expanded, as CBS does."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None:
        replan(child)


@dataclass(frozen=True)
class LazyExpansion:
    """Puts each child into OPEN with its parent's paths. The search replans it when it first selects it."""

    def __call__(self, child: Node, open_nodes: list[Node], replan: Callable[[Node], None]) -> None:
        open_nodes.append(child)


@runtime_checkable
class Experience(Protocol):
    """Returns the path that the low level begins with, or None."""

    def __call__(self, before: Path) -> Path | None: ...


@dataclass(frozen=True)
class FromScratch:
    """Gives the low level no earlier path."""

    def __call__(self, before: Path) -> Path | None:
        return None


@dataclass(frozen=True)
class FromParent:
    """Gives the low level the parent's path, of which it keeps what satisfies the child's constraints (xECBS)."""

    def __call__(self, before: Path) -> Path | None:
        return before
