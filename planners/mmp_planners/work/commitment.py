"""Commits motions along paths: times them, and begins them as early as the other arms let them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.timeline import Timeline
from mmp_planners.work.timing import TOLERANCE_RAD, Timing

LESS_ROUNDING = 0.1
"""Share of the tolerance at corners with which a path is timed again, if its rounded corners are not clear."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Proposal:
    """A motion of an arm that may be committed: it begins at a period and goes through samples [k, dof].

    Without samples the arm stays where it is.
    """

    arm: int
    begin: int
    samples: Float[np.ndarray, "k dof"]

    @property
    def end(self) -> int:
        """The period at which it ends."""
        return self.begin + max(len(self.samples) - 1, 0)


class Commitment:
    """Proposes and commits motions of single arms.

    Args:
        timeline: takes the motions.
        timing: times them.
        mover: tests motions that are timed alone against obstacles; None to prove each motion when it is timed.
    """

    def __init__(self, timeline: Timeline, timing: Timing, mover: MovePlanner | None) -> None:
        self._timeline, self._timing, self._mover = timeline, timing, mover

    def propose(self, arm: int, path: Float[np.ndarray, "k dof"], tolerance: float = TOLERANCE_RAD) -> Proposal | None:
        """Returns the motion of an arm along a path that is clear of where the others stand in the end.

        Args:
            arm: number of the arm.
            path: configurations from where the arm stands, straight in between [rad, of slides m].
            tolerance: largest distance of a joint from the path at its corners [rad, of slides m].

        Returns:
            The motion, as early as the others let it begin; None if it is not clear.
        """
        timeline = self._timeline
        if (path == path[0]).all():
            return Proposal(arm=arm, begin=timeline.end(arm), samples=path[:0])
        samples = None if self._mover is None else self._timing.unproved(timeline.names[arm], path, tolerance)
        if self._mover is not None and samples is not None and self._mover.keeps_margins(arm, samples):
            begin = timeline.earliest(arm, samples)
            if begin is not None:
                return Proposal(arm=arm, begin=begin, samples=samples)
        for rounding in (tolerance, LESS_ROUNDING * tolerance):
            rests = {name: timeline.rest(other) for other, name in enumerate(timeline.names)}
            samples = self._timing.of_arm(timeline.names[arm], path, rests, rounding)
            begin = None if samples is None else timeline.earliest(arm, samples)
            if samples is not None and begin is not None:
                return Proposal(arm=arm, begin=begin, samples=samples)
        return None

    def commit(self, proposal: Proposal) -> None:
        """Lets an arm do a motion."""
        if len(proposal.samples):
            self._timeline.append(proposal.arm, proposal.begin, proposal.samples)
