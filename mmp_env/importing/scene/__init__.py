"""Makes cells of whole compiled MuJoCo models: their arms, and everything else as obstacles."""
