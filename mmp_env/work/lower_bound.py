"""A lower bound of the makespan of jobs, for all motions, orders and arms: the tool cannot move faster than it can."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import chain_of
from mmp_env.model.arm import Arm
from mmp_env.model.goals import PoseGoal, Stay
from mmp_env.work.jobs import LINE_TOLERANCE, Job, Jobs, Line, Move, Wait
from mmp_env.work.trajectory import PERIOD_S


def makespan_lower_bound(jobs: Jobs, max_velocity: Mapping[str, Float[np.ndarray, "_dof"]]) -> float:
    """Returns a time [s] that every schedule of the jobs takes at least.

    It is the largest of these: the jobs that name one arm, one after the other; jobs that come after each other; all
    jobs, shared equally by all arms.

    Args:
        jobs: the work.
        max_velocity: arm name -> [dof] [rad/s].
    """
    speeds = {arm.name: tool_speed(arm, max_velocity[arm.name]) for arm in jobs.cell.arms}
    fastest = max(speeds.values())
    shortest = {job.name: job_lower_bound(job, fastest if job.arm is None else speeds[job.arm]) for job in jobs.jobs}
    of_arm = [sum(shortest[job.name] for job in jobs.jobs if job.arm == name) for name in speeds]
    return max(*of_arm, _longest_chain(jobs, shortest), sum(shortest.values()) / len(speeds))


def job_lower_bound(job: Job, speed: float) -> float:
    """Returns a time [s] that a job takes at least, from the end of its first move, for a tool speed [m/s]."""
    total, at = 0.0, None
    for step in job.steps:
        if isinstance(step, Wait):
            total += step.seconds
        elif isinstance(step, Line):
            by = np.array(step.by)
            total += _least_time(by, speed)
            at = None if at is None or np.linalg.norm(by) < 2 * LINE_TOLERANCE else at + by
        elif not isinstance(step, Move):
            total += PERIOD_S
        elif isinstance(step.goal, PoseGoal):
            total += 0.0 if at is None else _least_time(step.goal.position - at, speed)
            at = step.goal.position
        elif not isinstance(step.goal, Stay):
            at = None
    return total


def tool_speed(arm: Arm, max_velocity: Float[np.ndarray, "dof"]) -> float:
    """Returns an upper bound of the speed of the tool of an arm [m/s]: every joint moves it with its longest lever."""
    chain, robot = chain_of(arm.robot, arm.tool), arm.robot
    travel = np.where(chain.slides, np.maximum(np.abs(robot.lower), np.abs(robot.upper)), 0.0)
    after = np.linalg.norm(chain.offsets[1:], axis=1) + np.append(travel[1:], 0.0)
    levers = np.where(chain.slides, 1.0, np.cumsum(after[::-1])[::-1])
    return float(levers @ np.asarray(max_velocity))


def _least_time(by: Float[np.ndarray, "3"], speed: float) -> float:
    return max(0.0, float(np.linalg.norm(by)) - 2 * LINE_TOLERANCE) / speed


def _longest_chain(jobs: Jobs, shortest: Mapping[str, float]) -> float:
    """Returns the longest time of jobs that come after each other [s]."""
    left, done = list(jobs.jobs), dict[str, float]()
    while left:
        ready = [job for job in left if all(name in done for name in job.after)]
        for job in ready:
            done[job.name] = shortest[job.name] + max((done[name] for name in job.after), default=0.0)
        left = [job for job in left if job.name not in done]
    return max(done.values())
