"""A cell in MuJoCo: scene, simulation, renderer, and the monitored execution of plans."""
