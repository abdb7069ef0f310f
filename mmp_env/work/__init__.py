"""Work: jobs for the arms of a cell, and the schedule that does them, each arm in its own time."""
