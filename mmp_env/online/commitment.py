"""What the arms do from now on: motions one after the other, of which every part that they follow is proved."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.cell import Cell
from mmp_env.online.bodies import MovingBody
from mmp_env.online.budget import Budget
from mmp_env.online.deadlines import Deadlines
from mmp_env.online.motion import OnlineMotion, PhaseTiming
from mmp_env.online.planning import AHEAD_S, State
from mmp_env.retime.limits import split

_LOOK_S = 5.0
"""How far ahead on its motion an arm looks for bodies in the way [s]."""
_LEAST_S = 0.05
"""Shortest part of a motion for which arms at rest begin to move [s]."""
_COMMIT_S = 0.0005
"""Time that is left after a proof to choose what is committed, for each arm [s]."""


class Commitment:
    """Motions from rest to rest, and the bodies among which they are proved. Times are in periods.

    Args:
        standing: where the arms stand.
        margin: margin to the bodies [m].

    Attributes:
        motions: what is not over yet, in order.
        bodies: name -> body.
        standing: where the arms stand before the first motion.
    """

    def __init__(self, standing: State, margin: float) -> None:
        self.standing, self._margin = standing, margin
        self.motions: list[OnlineMotion] = []
        self.bodies: dict[str, MovingBody] = {}
        self._deadlines: dict[int, Deadlines] = {}

    def end(self, first: int) -> int:
        """Returns when the arms rest, not before a time."""
        return max([first, *(motion.end for motion in self.motions)])

    def rest(self) -> State:
        """Returns where the arms come to rest."""
        return _end_of(self.motions[-1]) if self.motions else self.standing

    def positions(self, cell: Cell, periods: Float[np.ndarray, "n"]) -> dict[str, Float[np.ndarray, "n _dof"]]:
        """Returns arm name -> the configurations [n, dof] at ascending times, which need not be whole."""
        rest = np.concatenate([self.standing[name] for name in cell.arm_names])
        rows = np.tile(rest, (len(periods), 1))
        for motion in self.motions:
            after = periods > motion.begin
            if after.any():
                rows[after] = motion.at(motion.phases(periods[after]))
        return split(cell, rows)

    def trapped(self, cell: Cell) -> frozenset[str]:
        """Returns the arms that a body may reach soon where they rest."""
        rest = self.rest()
        rows = {name: np.ascontiguousarray(np.tile(q, (2, 1))) for name, q in rest.items()}
        return frozenset(
            name
            for name in rest
            for body in self.bodies.values()
            if cell.collision.swept_clearance(name, rows[name], body.solid).min() - self._margin < body.speed * AHEAD_S
        )

    def stand(self) -> None:
        """Forgets all motions, which are over: the arms stand where they end."""
        self.standing, self.motions = self.rest(), []

    def forget(self, period: int) -> OnlineMotion | None:
        """Forgets what is over at a time. Returns the last motion that is, or None if none is."""
        over = None
        while self.motions and self.motions[0].end <= period:
            motion = self.motions[0]
            if not motion.ends and len(self.motions) == 1:
                break  # the arms may go on with it
            over, self.standing = motion, _end_of(motion)
            del self.motions[0]
            self._deadlines.pop(id(motion), None)
        for motion in self.motions:
            motion.forget(period)
        return over

    def append(self, motion: OnlineMotion, first: int, budget: Budget) -> bool:
        """Lets a motion follow the others, not before a time. Returns whether a part of it is proved and committed."""
        motion.begin = self.end(first)
        self.motions.append(motion)
        self.extend(motion, motion.begin, budget)
        if not motion.moves:
            self.motions.pop()
            self._deadlines.pop(id(motion), None)
        return motion.moves

    def extend(self, motion: OnlineMotion, first: int, budget: Budget, *, whole: bool = False) -> None:
        """Commits the longest part of a motion that is proved; or, on request, only the whole motion.

        Args:
            motion: one of the motions.
            first: from when on it may change.
            budget: time for the proof.
            whole: whether a part is not enough.
        """
        motion.prove(core.Clock(max(budget.left_s - _COMMIT_S * len(self.standing), 0.0)))
        timing = motion.timing_from(first, None)
        danger = self._guard(motion).first_danger(timing, budget)
        if danger is None and motion.is_proved(timing):
            motion.commit(timing)
            return
        if whole:
            return
        last = len(timing.phases) - 1 if danger is None else danger
        last = min(last, int(np.searchsorted(timing.phases, motion.proved_s, side="right")))
        best = self._safe(motion, first, first)
        low, high = first, first + last
        while best is not None and high - low > 1:
            middle = (low + high) // 2
            timing = self._safe(motion, first, middle)
            if timing is None:
                high = middle
            else:
                low, best = middle, timing
        if best is None or best.phases[-1] <= motion.timing.phases[-1]:
            return
        if motion.end > first or best.phases[-1] - best.phases[0] >= _LEAST_S:
            motion.commit(best)

    def brake(self, motion: OnlineMotion, first: int) -> None:
        """Lets a motion brake as soon as this is proved, from a time on."""
        timing = self._safe(motion, first, first)
        if timing is not None and timing.phases[-1] < motion.timing.phases[-1]:
            motion.commit(timing)

    def is_blocked(self, motion: OnlineMotion, first: int, now: float, budget: Budget) -> bool:
        """Returns whether a body may soon be in the way of a motion. `now` is in seconds."""
        guard = self._guard(motion)
        return guard.blocked_by(motion.phase(first), now + AHEAD_S, _LOOK_S, budget) is not None

    def see(self, body: MovingBody, first: int) -> bool:
        """Adds or replaces a body. Returns whether what is committed is proved, if need be after it brakes."""
        self.bodies[body.solid.name] = body
        self._deadlines.clear()
        for k, motion in enumerate(self.motions):
            left = motion.timing_left(first)
            if motion.end <= first or self._guard(motion).first_danger(left) is None:
                continue
            del self.motions[k + 1 :]
            if motion.begin >= first:
                del self.motions[k]
                return True
            stop = motion.timing_from(first, first)
            if stop.phases[-1] < motion.timing.phases[-1]:
                motion.commit(stop)
            return self._guard(motion).first_danger(stop) is None
        return True

    def unsee(self, name: str) -> bool:
        """Forgets a body. Returns whether there was one of this name."""
        self._deadlines.clear()
        return self.bodies.pop(name, None) is not None

    def _safe(self, motion: OnlineMotion, first: int, brakes: int) -> PhaseTiming | None:
        timing = motion.timing_from(first, brakes)
        proved = motion.is_proved(timing) and self._guard(motion).first_danger(timing) is None
        return timing if proved else None

    def _guard(self, motion: OnlineMotion) -> Deadlines:
        if id(motion) not in self._deadlines:
            self._deadlines[id(motion)] = Deadlines(motion, self.bodies, self._margin)
        return self._deadlines[id(motion)]


def _end_of(motion: OnlineMotion) -> State:
    """Returns where the committed part of a motion ends."""
    rows = split(motion.plan.problem.cell, motion.at(motion.timing.phases[-1:]))
    return {name: q[0] for name, q in rows.items()}
