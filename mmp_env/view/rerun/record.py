"""What a planner told: kept while it plans, at hardly any cost, and written when it has ended."""

from __future__ import annotations

from dataclasses import dataclass, field

from mmp_env.events import ConflictChosen, Event, NodeCreated, NodeExpanded, Repelled, SolutionFound
from mmp_env.model.problem import Problem
from mmp_env.view.search_tree import SearchTree
from mmp_env.view.tree_record import TreeNode


@dataclass(kw_only=True, eq=False)
class Look:
    """What the search looked at: a node, by its place in the tree, and the conflict that it was branched on.

    `expansion` is the number of nodes expanded, this one included.
    """

    expansion: int
    node: int
    told: NodeCreated
    conflict: ConflictChosen | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Push:
    """A repulsive modification, the node that it led to, and the number of nodes expanded by then."""

    expansion: int
    node: int
    repelled: Repelled
    told: NodeCreated


@dataclass(kw_only=True, eq=False)
class Record:
    """A watcher that keeps what is shown: the tree as a whole, the first nodes and repulsions with all their paths.

    `most_looks` expanded nodes, and `most_pushes` repulsions.
    """

    problem: Problem
    most_looks: int
    most_pushes: int
    tree: SearchTree = field(init=False)
    created_at: list[int] = field(default_factory=list)
    """For each node of the tree the number of nodes expanded when it was made."""
    open_nodes: list[int] = field(default_factory=list)
    """For each expansion, how many nodes were open."""
    looks: list[Look] = field(default_factory=list)
    pushes: list[Push] = field(default_factory=list)
    root: Look | None = None
    """The first node that was told of."""
    solution: Look | None = None

    def __post_init__(self) -> None:
        self.tree = SearchTree(self.problem)
        self._told: dict[int, NodeCreated] = {}
        self._repelled: Repelled | None = None

    def __call__(self, event: Event) -> None:
        before = self.tree.solution
        self.tree(event)
        match event:
            case NodeCreated():
                self._create(event)
            case NodeExpanded():
                self.open_nodes.append(event.open_nodes)
                if len(self.looks) < self.most_looks and event.node in self._told:
                    look = Look(expansion=self.count, node=self.tree.expansions[-1], told=self._told[event.node])
                    self.looks.append(look)
            case ConflictChosen():
                if self.looks and self.looks[-1].expansion == self.count:
                    self.looks[-1].conflict = event
            case Repelled():
                self._repelled = event
            case SolutionFound():
                self._solve(event, before)
        self.created_at += [self.count] * (len(self.tree.nodes) - len(self.created_at))

    @property
    def count(self) -> int:
        """Nodes expanded so far."""
        return len(self.tree.expansions)

    def _solve(self, event: SolutionFound, before: TreeNode | None) -> None:
        node, told = self.tree.solution, self._told.get(event.node)
        if node is not None and node is not before:  # otherwise the one before was cheaper
            self.solution = Look(expansion=self.count, node=node.id, told=told) if told else None

    def _create(self, event: NodeCreated) -> None:
        node = len(self.tree.nodes) - 1
        self.root = self.root or Look(expansion=0, node=node, told=event)
        # A long search makes more nodes than there is memory for paths that nobody sees.
        if len(self.looks) >= self.most_looks:
            self._told.clear()
        self._told[event.node] = event
        if self._repelled is not None and len(self.pushes) < self.most_pushes:
            self.pushes.append(Push(expansion=self.count, node=node, repelled=self._repelled, told=event))
        self._repelled = None
