"""Bodies whose place is known at one time, and whose speed is bounded afterwards."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mmp_env.model.arm import Obstacle


@dataclass(frozen=True, kw_only=True, eq=False)
class MovingBody:
    """A solid that was seen at a place, and no point of which moves faster than a bound from then on.

    Attributes:
        solid: the body where it was seen.
        speed: largest speed of any of its points [m/s]; 0 for one that stands still.
        seen_s: when it was seen [s].
    """

    solid: Obstacle
    speed: float
    seen_s: float

    def growth(self, time_s: float) -> float:
        """Returns how far any point of the body can be from where it was seen [m] at a later time [s]."""
        return self.speed * max(time_s - self.seen_s, 0.0)


def grown(solid: Obstacle, by: float) -> Obstacle:
    """Returns a solid of the same shape that covers all points within a distance `by` [m] of the given one."""
    if solid.size is not None:
        return replace(solid, size=np.asarray(solid.size) + 2 * by)
    length = None if solid.length is None else solid.length + (2 * by if solid.shape == "cylinder" else 0.0)
    return replace(solid, radius=(solid.radius or 0.0) + by, length=length)
