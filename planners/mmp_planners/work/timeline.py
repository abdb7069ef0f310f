"""The motions that the arms are bound to, on one time grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.problem import Problem

Snapshot = tuple[list[Float[np.ndarray, "_k _dof"]], dict[int, float], int]
"""Motions, durations of steps that are not `dt`, and version."""


class Timeline:
    """The committed motion of each arm. An arm stands at the end of its motion until it is given another.

    Any two motions, with the rest after them, are proved clear of each other. So every arm may stay where it is for
    good, at any time after its last motion.

    Args:
        problem: cell, start and velocity limits.
        dt: step of the grid [s].
    """

    def __init__(self, problem: Problem, dt: float) -> None:
        self.problem, self.dt, self.names = problem, dt, problem.cell.arm_names
        self._rows = [np.array(problem.start[name])[None] for name in self.names]
        self._durations: dict[int, float] = {}
        self.version = 0

    def end(self, arm: int) -> int:
        """Returns the step at which an arm comes to rest."""
        return len(self._rows[arm]) - 1

    def last(self) -> int:
        """Returns the step at which the last arm comes to rest."""
        return max(map(self.end, range(len(self.names))))

    def rest(self, arm: int) -> Float[np.ndarray, "dof"]:
        """Returns where an arm stands in the end [rad]."""
        return self._rows[arm][-1]

    def motion(self, arm: int, since: int) -> core.Motion:
        """Returns the motion of an arm from a step on."""
        return self.problem.cell.collision.motion(self.names[arm], self._rows[arm][min(since, self.end(arm)) :])

    def motions(self, since: int, but: Sequence[int]) -> list[core.Motion]:
        """Returns the motions of all arms but some from a step on."""
        return [self.motion(arm, since) for arm in range(len(self.names)) if arm not in but]

    def append(self, arm: int, rows: Float[np.ndarray, "k dof"]) -> None:
        """Lets an arm move through `rows` [k, dof] [rad] from its rest, which is the first of them."""
        self._rows[arm] = np.concatenate([self._rows[arm], rows[1:]])
        self.version += 1

    def wait(self, arm: int, until: int) -> None:
        """Lets an arm stand until a step, if that is later than its end."""
        more = until - self.end(arm)
        if more > 0:
            self._rows[arm] = np.concatenate([self._rows[arm], np.repeat(self._rows[arm][-1:], more, axis=0)])

    def append_together(self, times: Float[np.ndarray, "t"], rows: Mapping[str, Float[np.ndarray, "t _dof"]]) -> None:
        """Lets all arms move on common times [s] from the step at which the last of them is at rest."""
        last = self.last()
        for arm, name in enumerate(self.names):
            self.wait(arm, last)
            self._rows[arm] = np.concatenate([self._rows[arm], rows[name][1:]])
        self._durations |= {last + k: float(step) for k, step in enumerate(np.diff(times))}
        self.version += 1

    def snapshot(self) -> Snapshot:
        """Returns the state of the timeline, for `restore`."""
        return list(self._rows), dict(self._durations), self.version

    def restore(self, snapshot: Snapshot) -> None:
        """Takes back all that was committed after a snapshot."""
        rows, durations, self.version = snapshot
        self._rows, self._durations = list(rows), dict(durations)

    def sampled(self) -> tuple[Float[np.ndarray, "t"], dict[str, Float[np.ndarray, "t _dof"]]]:
        """Returns times [s] and positions of all arms. A step too fast for a joint is stretched for all arms."""
        last = self.last()
        rows = {
            name: np.concatenate([each, np.repeat(each[-1:], last + 1 - len(each), axis=0)])
            for name, each in zip(self.names, self._rows, strict=True)
        }
        steps = np.array([self._durations.get(k, self.dt) for k in range(last)])
        for name, each in rows.items():
            fastest = (np.abs(np.diff(each, axis=0)) / self.problem.max_velocity[name]).max(axis=1, initial=0.0)
            steps = np.maximum(steps, fastest)
        return np.concatenate([[0.0], np.cumsum(steps)]), rows
