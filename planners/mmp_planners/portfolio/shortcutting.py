"""Shortcutting on the common clock: a part that any planner can be composed with.

Shortcuts replace motion windows of one arm, of one joint, or of all arms at once by shorter motions, if these are
proved clear of everything (`native/improve/shortcutting.hpp`). The cost is L1, so a path on which no joint turns back
is as short as the straight line; such paths are tried too (`native/improve/shortcut_moves.hpp`). An arm with several
candidates may end at another one. Shortcuts keep the passing order: the clock is common, and only shorter motions are
kept.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core
from mmp_env.model.cell import Cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.goal_choice import ending_at
from mmp_planners.options import GRID_STEP_S

Rows = Float[np.ndarray, "k _"]  # arms may have different numbers of joints
MOST_STEPS = 10_000
"""Largest number of grid steps. The grid of a longer plan has longer steps."""


@dataclass(frozen=True, kw_only=True)
class Shortcutting:
    """Shortens a plan on a grid. The same seed gives the same plan.

    Attributes:
        attempts: number of attempts. They are repeated as long as they save `repeat_gain`.
        dt: step of the grid [s].
        repeat_gain: minimum relative saving.
    """

    attempts: int
    dt: float = GRID_STEP_S
    repeat_gain: float = math.inf

    def __call__(
        self, plan: Plan, seed: int, clock: core.Clock, *, groups: Sequence[int] | None = None
    ) -> tuple[Plan, int]:
        """Shortens a plan.

        Args:
            plan: a plan without contact.
            seed: seed of the attempts.
            clock: deadline.
            groups: a group number for each arm. Arms of different groups pass through each other, so the result is no
                safe plan. Without it, all arms are one group.

        Returns:
            The shorter plan, not certified yet, and the number of replaced motion windows.
        """
        problem = plan.problem
        names, dt = problem.cell.arm_names, step_of_grid(plan, self.dt)
        rows, kept = core.shortcut(
            problem.cell.collision.core,
            on_grid(plan, dt),
            [problem.max_velocity[name] * dt for name in names],
            goals=[np.ascontiguousarray(problem.goals[name]) for name in names],
            levels=problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            groups=groups if groups is not None else [0] * len(names),
            settings=core.ShortcutSettings(attempts=self.attempts, min_saving=self.repeat_gain),
            seed=seed,
            clock=clock,
        )
        return (retime_to_velocity_limits(problem, rows) if kept else plan), kept


def step_of_grid(plan: Plan, dt: float) -> float:
    """Returns the step [s] of a grid for the plan: `dt`, or more if it would have over `MOST_STEPS` steps."""
    return max(dt, plan.makespan_s / MOST_STEPS)


def on_grid(plan: Plan, dt: float) -> list[Rows]:
    """Returns the configurations [k, dof] of each arm on a grid of at most `dt` [s] that keeps all waypoints."""
    dt = step_of_grid(plan, dt)
    counts = np.ceil(np.diff(plan.times) / dt - 1e-6).astype(int)
    return divided([plan.positions[name] for name in plan.problem.cell.arm_names], counts)


def divided(rows: Sequence[Rows], counts: Int[np.ndarray, "steps"]) -> list[Float[np.ndarray, "n _"]]:
    """Returns the configurations of each arm, with each step divided into as many equal parts as `counts` says."""
    counts = np.maximum(counts, 1)
    instants = np.interp(
        np.arange(counts.sum() + 1), np.concatenate([[0], np.cumsum(counts)]), np.arange(len(counts) + 1)
    )
    before = instants.astype(int)
    after, share = np.minimum(before + 1, len(counts)), (instants - before)[:, None]
    return [q[before] + share * (q[after] - q[before]) for q in rows]


def retime_to_velocity_limits(problem: Problem, rows: Sequence[Rows]) -> Plan:
    """Returns a plan through `rows`, configurations [k, dof] [rad] of each arm with the same k; `retime_all_joints`."""
    return retime_all_joints(problem, np.concatenate(rows, axis=1))


def retime_all_joints(problem: Problem, q: Float[np.ndarray, "k all_dof"]) -> Plan:
    """Returns a plan through configurations of all arms, each step as short as the velocity limits allow.

    All arms keep one clock, so arms that were clear of each other stay clear. The ends are exactly the start and the
    nearest candidates, which the plan chooses as its goal.

    Args:
        problem: the problem of the plan.
        q: configurations [rad, of slides m], the arms in the order of the cell.
    """
    # All joints of all arms in one array, which is several times as fast as arm by arm in cells of many arms.
    if not problem.single_goals:
        problem = ending_at(problem, _of_arms(problem.cell, q[-1:]))
    start, goal, limits = problem.joint_start, problem.joint_goal, problem.joint_max_velocity
    lower, upper = problem.cell.joint_limits
    q = np.minimum(np.maximum(q, lower), upper)
    if len(q) == 1:
        q = np.repeat(q, 2, axis=0)
    q[0], q[-1] = start, goal
    # Steps without motion are dropped: no arm waits for anything.
    durations = _step_durations(q, limits)
    kept = durations > 1e-9
    if not kept.all():
        kept = np.concatenate([[True], kept])
        kept[-1] |= not kept[1:].any() and bool((start != goal).any())
        q = q[kept]
        q[-1] = goal
        durations = _step_durations(q, limits)
    lasting = np.maximum(durations, 1e-9)
    times = np.empty(len(q))
    times[0] = 0.0
    # One rounding step more: late in a plan, rounded times would make a step of nanoseconds too short.
    np.cumsum(lasting + np.spacing(lasting.sum()), out=times[1:])
    return Plan(problem=problem, times=times, positions=_of_arms(problem.cell, q))


def _of_arms(cell: Cell, q: Float[np.ndarray, "k all_dof"]) -> dict[str, Rows]:
    """Returns arm name -> its columns of the configurations of all arms."""
    ends = itertools.accumulate(arm.dof for arm in cell.arms)
    return {arm.name: np.ascontiguousarray(q[:, end - arm.dof : end]) for arm, end in zip(cell.arms, ends, strict=True)}


def _step_durations(
    q: Float[np.ndarray, "k all_dof"], limits: Float[np.ndarray, "all_dof"]
) -> Float[np.ndarray, "steps"]:
    """Returns how long the slowest joint of all arms takes for each step [s]."""
    return (np.abs(q[1:] - q[:-1]) / limits).max(axis=1)
