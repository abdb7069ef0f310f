"""Reference implementations of the native core: slow, obvious NumPy float64, written from the mathematics alone."""
