"""Shortcutting on the common clock: a part that any planner can be composed with.

Stretches of one arm's path, of one of its joints, or of all arms at once are replaced by straight ones and kept where
they are proved clear of everything (`native/shortcut.hpp`). No order of passing is ever changed by being late: the
clock is common, and only shorter ways are taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import _core
from mmp_env.collision import HIT, KEEP_PROOF
from mmp_env.plan import Plan
from mmp_env.problem import Problem

Rows = Float[np.ndarray, "k dof"]


@dataclass(frozen=True, kw_only=True)
class Shortcutting:
    """`attempts` to shorten a plan on a grid of `dt` [s]; the same seed gives the same plan."""

    attempts: int
    dt: float = 0.1

    def __call__(self, plan: Plan, seed: int, clock: _core.Clock) -> tuple[Plan, int]:
        """The plan made shorter, its certificate still to come, and how many stretches were replaced."""
        problem = plan.problem
        names = problem.cell.arm_names
        rows, kept = _core.shorten(
            problem.cell.collision.core,
            on_grid(plan, self.dt),
            [problem.max_velocity[name] * self.dt for name in names],
            HIT * problem.margin,
            KEEP_PROOF * problem.margin,
            KEEP_PROOF * problem.margin,
            self.attempts,
            seed,
            clock,
        )
        return (paced(problem, rows) if kept else plan), kept


def on_grid(plan: Plan, dt: float) -> list[Rows]:
    """Configurations of every arm, each stretch of the plan in whole steps of `dt` [s] or a little less."""
    counts = np.maximum(np.ceil(np.diff(plan.times) / dt - 1e-6).astype(int), 1)
    last = int(counts.sum())
    instants = np.interp(np.arange(last + 1), np.concatenate([[0], np.cumsum(counts)]), np.arange(len(plan.times)))
    out = []
    for name in plan.problem.cell.arm_names:
        q = plan.positions[name]
        columns = [np.interp(instants, np.arange(len(q)), column) for column in q.T]
        out.append(np.ascontiguousarray(np.column_stack(columns)))
    return out


def paced(problem: Problem, rows: Sequence[Rows]) -> Plan:
    """A plan through `rows`, one array an arm, each step as short as the slowest of all joints allows.

    The ends are put exactly on start and goal. One clock for all arms, so what was clear of each other stays so.
    """
    names = problem.cell.arm_names
    q = {name: np.array(r, dtype=float) for name, r in zip(names, rows, strict=True)}
    lasting = np.zeros(len(rows[0]) - 1)
    for arm in problem.cell.arms:
        q[arm.name] = np.clip(q[arm.name], arm.robot.lower, arm.robot.upper)
        q[arm.name][0], q[arm.name][-1] = problem.start[arm.name], problem.goal[arm.name]
        if len(lasting):
            needed = np.abs(np.diff(q[arm.name], axis=0)) / problem.max_velocity[arm.name]
            lasting = np.maximum(lasting, needed.max(axis=1))
    # Where nothing moves nobody waits for anything.
    kept = np.concatenate([[True], lasting > 1e-9])
    kept[-1] |= not kept[1:].any() and any((q[name][0] != q[name][-1]).any() for name in names)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(lasting[kept[1:]], 1e-9))])
    return Plan(problem=problem, times=times, positions={name: q[name][kept] for name in names})
