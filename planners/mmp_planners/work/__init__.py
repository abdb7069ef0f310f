"""Schedules of jobs: every arm plans its next motion against the motions that the other arms are already bound to."""
