"""Importing: arms from URDF and MJCF files, with convex pieces and proved sphere covers."""
