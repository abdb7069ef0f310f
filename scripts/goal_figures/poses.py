"""Plans with tool poses as goals beside plans with the joint goals that the poses come from."""

from __future__ import annotations

import time
from collections.abc import Mapping
from statistics import mean, median
from typing import Any, NamedTuple

import numpy as np
from figure import print_figure

import mmp_env
import mmp_planners
from mmp_env.ik.chain import chain_of
from mmp_env.importing.scene.scene_obstacles import pose_quaternion
from mmp_env.model.goals import GivenGoal, PoseGoal
from mmp_env.model.problem import Problem

TIME_LIMIT_S = 60.0


class Run(NamedTuple):
    """One instance: times [s] of `make_problem`, of the planner until its first plan and of the whole, and cost."""

    made_s: float
    first_s: float
    whole_s: float
    cost_rad: float
    valid: bool


def measure(arms: int, count: int) -> None:
    """Prints the figures of instances of `MultiArmCell-<arms>`.

    Args:
        arms: number of arms.
        count: number of instances: those of the seeds from 0 on.
    """
    cell, runs = mmp_env.ring_cell(arms), []
    for seed in range(-1, count):  # the first one loads what later ones have
        drawn = mmp_env.draw_problem(cell, seed=max(seed, 0))
        both = _run(drawn, drawn.goal, max(seed, 0)), _run(drawn, _tool_poses(drawn), max(seed, 0))
        if seed >= 0:
            runs.append(both)
    of: dict[str, Any] = {"instances": count}
    name = f"poses_{arms}_arms"
    print_figure(f"{name}_solved", sum(poses.valid for _, poses in runs), f"of {count}")
    costs = [poses.cost_rad / joints.cost_rad for joints, poses in runs if poses.valid and joints.valid]
    print_figure(f"{name}_cost", mean(costs), "x the cost with joint goals", most=max(costs), **of)
    for what, of_run in (("first_plan", _first), ("first_plan_and_problem", _first_and_problem), ("planning", _whole)):
        joints, poses = (median(of_run(run) for run in side) for side in zip(*runs, strict=True))
        print_figure(
            f"{name}_{what}", poses, "s", joint_goals=joints, ratio=poses / joints, ratio_to="joint goals", **of
        )
    made = [median(run.made_s for run in side) for side in zip(*runs, strict=True)]
    print_figure(f"{name}_make_problem", made[1], "s", joint_goals=made[0], **of)


def _first(run: Run) -> float:
    return run.first_s


def _first_and_problem(run: Run) -> float:
    return run.first_s + run.made_s


def _whole(run: Run) -> float:
    return run.whole_s


def _tool_poses(problem: Problem) -> dict[str, PoseGoal]:
    """Returns the poses of the tools at the goal."""
    out = {}
    for arm in problem.cell.arms:
        frames = chain_of(arm.robot, arm.tool).frames(problem.goal[arm.name][None])
        in_base = np.eye(4)
        in_base[:3, :3], in_base[:3, 3] = frames.rotation[0], frames.position[0]
        pose = arm.T_world_base @ in_base
        out[arm.name] = PoseGoal(pose[:3, 3], pose_quaternion(pose))
    return out


def _run(drawn: Problem, goal: Mapping[str, GivenGoal], seed: int) -> Run:
    begin = time.process_time()
    problem = mmp_env.make_problem(drawn.cell, drawn.start, goal)
    made = time.process_time() - begin
    planner = mmp_planners.make("auto", rounds=0)
    begin = time.process_time()
    planner.plan(problem, seed=seed, time_limit=TIME_LIMIT_S)
    first = time.process_time() - begin
    begin = time.process_time()
    result = mmp_planners.make("auto").plan(problem, seed=seed, time_limit=TIME_LIMIT_S)
    whole = time.process_time() - begin
    if result.plan is None:
        return Run(made, first, whole, float("nan"), False)
    return Run(made, first, whole, result.plan.cost_rad, mmp_env.check_plan(result.plan).valid)
