"""Slow, obvious twins of the native core, in NumPy float64, written from the mathematics and not from the core."""
