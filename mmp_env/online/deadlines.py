"""Until when each part of a motion keeps the margin to bodies that may move: the proof of a timing of its phase.

A body that was seen at the time t0 and moves at v at most is at the time t within a distance v (t - t0) of where it
was. So an arm that keeps the clearance c from the place of the body keeps the margin m until t0 + (c - m) / v. A timing
is safe if the phase has left each part of the motion by then. An arm that stands may be met by a body that moves, but
not by one that stands still.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.online.bodies import MovingBody
from mmp_env.online.budget import Budget
from mmp_env.online.motion import PERIOD_S, OnlineMotion, PhaseTiming
from mmp_env.retime.limits import split

_BLOCK = 128
"""Parts of a motion whose clearances are computed at once."""
_ROUNDING_M = 1e-6
"""What is taken off every clearance, for rounding [m]."""


class Deadlines:
    """The latest times at which a motion may be in each of its parts, for some bodies.

    A part is a period of the phase. The parts are computed when they are needed.

    Args:
        motion: the motion.
        bodies: name -> body.
        margin: margin to the bodies [m].
    """

    def __init__(self, motion: OnlineMotion, bodies: Mapping[str, MovingBody], margin: float) -> None:
        self._motion, self._bodies, self._margin = motion, bodies, margin
        self._latest: dict[tuple[str, int], Float[np.ndarray, "b"]] = {}

    def first_danger(self, timing: PhaseTiming, budget: Budget | None = None) -> int | None:
        """Returns the first period of a timing in which it is not known to be safe, None if there is none.

        A timing beyond its begin is not known to be safe if there is no time left to look at it.
        """
        if not self._bodies:
            return None
        phases, first = timing.phases, self._motion.first_s
        parts = np.floor((phases - first) / PERIOD_S + 1e-6).astype(int)
        times = PERIOD_S * (self._motion.begin + timing.first + np.arange(len(phases)))
        moving = np.append(np.diff(phases) > 0, False)
        leaves = np.append(times[1:], times[-1])
        for begin in range(0, len(phases), _BLOCK):
            if begin and budget is not None and not budget.left_s:
                return begin
            rows = slice(begin, begin + _BLOCK)
            first_part, last = int(parts[begin]), int(parts[min(begin + _BLOCK, len(parts) - 1)])
            danger = np.zeros(len(parts[rows]), dtype=bool)
            for name, body in self._bodies.items():
                latest = self._until(name, first_part, last)
                here = latest[parts[rows] - first_part]
                after = latest[np.append(parts[rows][1:], last) - first_part]
                late = np.minimum(here, after) < leaves[rows]
                danger |= late if body.speed == 0 else late & moving[rows]
            if danger.any():
                return begin + int(np.argmax(danger))
        return None

    def blocked_by(self, phase_s: float, time_s: float, look_s: float, budget: Budget) -> str | None:
        """Returns a body that may be in the way at a time [s], from a phase [s] on, for `look_s` [s]; or None.

        Looks less far ahead if there is no time left.
        """
        motion = self._motion
        first = int((phase_s - motion.first_s) / PERIOD_S)
        last = int((min(motion.end_s, phase_s + look_s) - motion.first_s) / PERIOD_S)
        for begin in range(first, last + 1, _BLOCK):
            if not budget.left_s:
                break
            for name, body in self._bodies.items():
                latest = self._until(name, begin, min(begin + _BLOCK - 1, last))
                if (latest < (time_s if body.speed else 0.0)).any():
                    return name
        return None

    def _until(self, name: str, first: int, last: int) -> Float[np.ndarray, "n"]:
        """Returns the latest times [s] of the parts from `first` to `last`, both included."""
        blocks = range(first // _BLOCK, last // _BLOCK + 1)
        rows = np.concatenate([self._block(name, block) for block in blocks])
        return rows[first - blocks[0] * _BLOCK : last + 1 - blocks[0] * _BLOCK]

    def _block(self, name: str, block: int) -> Float[np.ndarray, "b"]:
        if (name, block) not in self._latest:
            body, motion = self._bodies[name], self._motion
            q = motion.at(motion.first_s + PERIOD_S * (block * _BLOCK + np.arange(_BLOCK + 1)))
            room = clearances(motion.plan.problem.cell, q, body, motion.stray_rad) - self._margin
            if body.speed == 0:
                self._latest[name, block] = np.where(room >= 0, np.inf, -np.inf)
            else:
                self._latest[name, block] = np.where(room >= 0, body.seen_s + room / body.speed, -np.inf)
        return self._latest[name, block]


def clearances(
    cell: Cell, q: Float[np.ndarray, "n dofs"], body: MovingBody, stray_rad: float
) -> Float[np.ndarray, "n-1"]:
    """Returns lower bounds [n - 1] [m] of the clearance of arms from the place of a body along lines.

    Arms that stand do not count if the body may move.
    """
    least = np.full(len(q) - 1, np.inf)
    for arm, rows in split(cell, q).items():
        counts = (np.diff(rows, axis=0) != 0).any(axis=1) | (body.speed == 0)
        if counts.any():
            bounds = cell.collision.swept_clearance(arm, rows, body.solid, stray=stray_rad)
            least = np.where(counts, np.minimum(least, bounds), least)
    return least - _ROUNDING_M
