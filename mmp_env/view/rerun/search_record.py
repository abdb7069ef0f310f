"""Events of a search that a recording shows; they are kept while the planner runs and written afterwards."""

from __future__ import annotations

from dataclasses import dataclass, field

from mmp_env.events import ConflictChosen, Event, NodeCreated, NodeExpanded, Repelled, SolutionFound
from mmp_env.model.problem import Problem
from mmp_env.view.search_tree import SearchTree
from mmp_env.view.tree_record import TreeNode


@dataclass(kw_only=True, eq=False)
class RecordedNode:
    """A node that is shown in detail, with its index in the tree and the conflict that it was branched on.

    `expansion` counts the expanded nodes up to and including this one.
    """

    expansion: int
    node: int
    created: NodeCreated
    conflict: ConflictChosen | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedRepulsion:
    """A repulsive modification, the node that it led to, and the number of nodes expanded before it."""

    expansion: int
    node: int
    repelled: Repelled
    created: NodeCreated


@dataclass(kw_only=True, eq=False)
class SearchRecord:
    """A watcher that keeps the whole tree, and the first nodes and repulsions with all their paths.

    It keeps `most_nodes` expanded nodes and `most_repulsions` repulsive modifications.
    """

    problem: Problem
    most_nodes: int
    most_repulsions: int
    tree: SearchTree = field(init=False)
    created_at: list[int] = field(default_factory=list)
    """Number of nodes expanded before each node of the tree was created."""
    open_nodes: list[int] = field(default_factory=list)
    """Number of open nodes at each expansion."""
    expanded_nodes: list[RecordedNode] = field(default_factory=list)
    repulsions: list[RecordedRepulsion] = field(default_factory=list)
    root: RecordedNode | None = None
    """First node that was created."""
    solution: RecordedNode | None = None

    def __post_init__(self) -> None:
        self.tree = SearchTree(self.problem)
        self._created: dict[int, NodeCreated] = {}
        self._repelled: Repelled | None = None

    def __call__(self, event: Event) -> None:
        before = self.tree.solution
        self.tree(event)
        match event:
            case NodeCreated():
                self._create(event)
            case NodeExpanded():
                self.open_nodes.append(event.open_nodes)
                if len(self.expanded_nodes) < self.most_nodes and event.node in self._created:
                    look = RecordedNode(
                        expansion=self.count, node=self.tree.expansions[-1], created=self._created[event.node]
                    )
                    self.expanded_nodes.append(look)
            case ConflictChosen():
                if self.expanded_nodes and self.expanded_nodes[-1].expansion == self.count:
                    self.expanded_nodes[-1].conflict = event
            case Repelled():
                self._repelled = event
            case SolutionFound():
                self._solve(event, before)
        self.created_at += [self.count] * (len(self.tree.nodes) - len(self.created_at))

    @property
    def count(self) -> int:
        """Number of nodes expanded so far."""
        return len(self.tree.expansions)

    def _solve(self, event: SolutionFound, before: TreeNode | None) -> None:
        node, created = self.tree.solution, self._created.get(event.node)
        if node is not None and node is not before:  # otherwise the one before was cheaper
            self.solution = RecordedNode(expansion=self.count, node=node.id, created=created) if created else None

    def _create(self, event: NodeCreated) -> None:
        node = len(self.tree.nodes) - 1
        self.root = self.root or RecordedNode(expansion=0, node=node, created=event)
        # A long search creates more nodes than there is memory for paths, and nobody sees these.
        if len(self.expanded_nodes) >= self.most_nodes:
            self._created.clear()
        self._created[event.node] = event
        if self._repelled is not None and len(self.repulsions) < self.most_repulsions:
            self.repulsions.append(
                RecordedRepulsion(expansion=self.count, node=node, repelled=self._repelled, created=event)
            )
        self._repelled = None
