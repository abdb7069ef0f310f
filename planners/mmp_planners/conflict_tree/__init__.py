"""Conflict-tree search: nodes, their expansion and selection, constraints, repulsion and the fast track."""
