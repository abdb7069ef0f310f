"""Commits motions along paths: times them, and begins them as early as the other arms let them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_planners.work.timeline import Timeline
from mmp_planners.work.timing import TOLERANCE_RAD, Timing

LESS_ROUNDING = 0.1
"""Share of the tolerance at corners with which a path is timed again, if its rounded corners are not clear."""


class Commitment:
    """Commits motions of single arms.

    Args:
        timeline: takes the motions.
        timing: times them.
    """

    def __init__(self, timeline: Timeline, timing: Timing) -> None:
        self._timeline, self._timing = timeline, timing

    def commit(self, arm: int, path: Float[np.ndarray, "k dof"], tolerance: float = TOLERANCE_RAD) -> int | None:
        """Lets an arm move along a path that is clear of where the others stand in the end.

        Args:
            arm: number of the arm.
            path: configurations from where the arm stands, straight in between [rad, of slides m].
            tolerance: largest distance of a joint from the path at its corners [rad, of slides m].

        Returns:
            The period at which the motion begins; None if the motion is not clear.
        """
        timeline = self._timeline
        if (path == path[0]).all():
            return timeline.end(arm)
        for rounding in (tolerance, LESS_ROUNDING * tolerance):
            rests = {name: timeline.rest(other) for other, name in enumerate(timeline.names)}
            samples = self._timing.of_arm(timeline.names[arm], path, rests, rounding)
            begin = None if samples is None else timeline.earliest(arm, samples)
            if samples is not None and begin is not None:
                timeline.append(arm, begin, samples)
                return begin
        return None
