"""A cell in MuJoCo: its scene, its simulation, and the execution of plans with what is watched meanwhile."""
