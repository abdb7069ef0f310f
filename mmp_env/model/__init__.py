"""Robots, cells, problems and plans, and the collision queries and certificates about them. No files, no MuJoCo."""
