"""The figures of `bench_goals.py`, one module per part."""
