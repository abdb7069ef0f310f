"""Meshes: files, convex hulls, and decomposition into convex pieces. They alone load SciPy, trimesh and CoACD."""
