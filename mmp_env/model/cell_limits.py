"""How small and how large anything in a cell may be, for all who read cells: the checker among them."""

import math

SMALLEST_M, LARGEST_M = 1e-6, 100.0
"""Edges, radii and lengths lie between these, positions within the larger one of the origin of their frame [m]."""
LARGEST_YAW_RAD = 2 * math.pi + 1e-4
"""Largest turn about z [rad]: a full turn, with room for rounding. A larger number is most likely in degrees."""
