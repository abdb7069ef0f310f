"""Planning while the arms move: a committed motion, bodies that appear and move, and goals that change.

`bodies` are the solids whose place is known at one time and whose speed is bounded. `motion` is a retimed plan with the
phase that the arms follow, and where it brakes. `deadlines` says until when each part of it is safe. `online_planner`
puts them together. docs/explanation/online.md has the proof.
"""
