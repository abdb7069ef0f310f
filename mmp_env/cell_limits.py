"""How small and how large anything in a cell may be, for all who read cells: the checker among them."""

SMALLEST_M, LARGEST_M = 1e-6, 100.0
"""Edges, radii and lengths lie between these, positions within the larger one of the origin of their frame [m]."""
