"""Fuzzing: changed files, changed options and hostile arrays, tried by the thousand. scripts/fuzz.sh runs it.

`samples` has good files and command lines, `changes` changes them, `worker` runs them in a process of its own, `judges`
decides what is a fault, `core_arrays` makes hostile calls of the native core, and `__main__` puts them together.
"""
