"""Shortcutting on the common clock: a part that any planner can be composed with.

Shortcuts replace motion windows of one arm, of one joint, or of all arms at once by shorter motions, if these are
proved clear of everything (`native/improve/shortcutting.hpp`). The cost is L1, so a path on which no joint turns back
is as short as the straight line; such paths are tried too (`native/improve/shortcut_moves.hpp`). Shortcuts keep the
passing order: the clock is common, and only shorter motions are kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem

Rows = Float[np.ndarray, "k _"]  # arms may have different numbers of joints
MOST_STEPS = 10_000
"""Of a grid; a plan that lasts longer, with a joint as slow as that, has longer steps."""


@dataclass(frozen=True, kw_only=True)
class Shortcutting:
    """`attempts` to shorten a plan on a grid of `dt` [s]; the same seed gives the same plan.

    As many attempts again as long as they make it shorter by a share `worth`.
    """

    attempts: int
    dt: float = 0.1
    worth: float = math.inf

    def __call__(
        self, plan: Plan, seed: int, clock: core.Clock, *, groups: Sequence[int] | None = None
    ) -> tuple[Plan, int]:
        """The plan made shorter, its certificate still to come, and how many stretches were replaced.

        `groups`: a number for each arm; those of different numbers pass through each other, so the plan is not safe.
        """
        problem = plan.problem
        names, dt = problem.cell.arm_names, step_of_grid(plan, self.dt)
        rows, kept = core.shortcut(
            problem.cell.collision.core,
            on_grid(plan, dt),
            [problem.max_velocity[name] * dt for name in names],
            levels=problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            groups=groups if groups is not None else [0] * len(names),
            settings=core.ShortcutSettings(attempts=self.attempts, min_saving=self.worth),
            seed=seed,
            clock=clock,
        )
        return (retime_to_velocity_limits(problem, rows) if kept else plan), kept


def step_of_grid(plan: Plan, dt: float) -> float:
    """The step [s] of a grid for the plan: `dt`, or more where those would be too many."""
    return max(dt, plan.makespan_s / MOST_STEPS)


def on_grid(plan: Plan, dt: float) -> list[Rows]:
    """Configurations of every arm, each stretch of the plan in whole steps of `step_of_grid` or a little less."""
    dt = step_of_grid(plan, dt)
    counts = np.maximum(np.ceil(np.diff(plan.times) / dt - 1e-6).astype(int), 1)
    last = int(counts.sum())
    instants = np.interp(np.arange(last + 1), np.concatenate([[0], np.cumsum(counts)]), np.arange(len(plan.times)))
    before = instants.astype(int)
    after, share = np.minimum(before + 1, len(plan.times) - 1), (instants - before)[:, None]
    rows = [plan.positions[name] for name in plan.problem.cell.arm_names]
    return [q[before] + share * (q[after] - q[before]) for q in rows]


def retime_to_velocity_limits(problem: Problem, rows: Sequence[Rows]) -> Plan:
    """A plan through `rows`, one array an arm, each step as short as the slowest of all joints allows.

    The ends are put exactly on start and goal. One clock for all arms, so what was clear of each other stays so.
    """
    q: dict[str, Rows] = {}
    for arm, given in zip(problem.cell.arms, rows, strict=True):
        inside = np.clip(np.asarray(given, dtype=float), arm.robot.lower, arm.robot.upper)
        q[arm.name] = np.repeat(inside, 2, axis=0) if len(inside) == 1 else inside
        q[arm.name][0], q[arm.name][-1] = problem.start[arm.name], problem.goal[arm.name]
    # Where nothing moves nobody waits for anything.
    kept = np.concatenate([[True], _step_durations(problem, q) > 1e-9])
    kept[-1] |= not kept[1:].any() and any((rows[0] != rows[-1]).any() for rows in q.values())
    q = {name: rows[kept] for name, rows in q.items()}
    for name, left in q.items():
        left[-1] = problem.goal[name]
    lasting = np.maximum(_step_durations(problem, q), 1e-9)
    # A hair more: late in a plan a step of nanoseconds would come out too short, for times are rounded.
    times = np.concatenate([[0.0], np.cumsum(lasting + np.spacing(lasting.sum()))])
    return Plan(problem=problem, times=times, positions=q)


def _step_durations(problem: Problem, q: Mapping[str, Rows]) -> Float[np.ndarray, "steps"]:
    """How long the slowest joint of all arms takes for each step [s]."""
    needed = [np.abs(np.diff(rows, axis=0)) / problem.max_velocity[name] for name, rows in q.items()]
    return np.max([joints.max(axis=1) for joints in needed], axis=0)
