"""Crowded robot-arm cells: robots, collision queries, problems and plans, their checker, and a Gymnasium environment.

Importing this package registers the environments `MultiArmCell` and `MultiArmCell-2` to `-64` with Gymnasium.
The names below are loaded at first use.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mmp_env import checkout
from mmp_env.gym.registration import register_environments

if TYPE_CHECKING:
    from mmp_env.errors import (
        InvalidInstanceError,
        MmpError,
        MovedBodyWarning,
        UnknownNameError,
        UnretimedPlanWarning,
    )
    from mmp_env.files.cell_file import load_cell
    from mmp_env.files.cell_source import find_cell
    from mmp_env.files.instance_file import load_instances
    from mmp_env.files.plan_check import check_plan
    from mmp_env.files.plan_file import load_plan, save_plan
    from mmp_env.gym.batch import BatchedEnv, batched_env
    from mmp_env.gym.env import MultiArmCellEnv
    from mmp_env.gym.instances import draw_instance, draw_problem
    from mmp_env.gym.parallel import parallel_env
    from mmp_env.importing.scene.model_cell import cell_from_mujoco
    from mmp_env.model.arm import Arm, Obstacle, place_arm
    from mmp_env.model.cell import Cell
    from mmp_env.model.collision import CollisionModel
    from mmp_env.model.conflict import Conflict
    from mmp_env.model.goals import AnyOf, JointGoal, NamedGoal, PoseGoal, Stay
    from mmp_env.model.keep import Upright
    from mmp_env.model.lines import line_cell
    from mmp_env.model.plan import Plan
    from mmp_env.model.problem import Problem
    from mmp_env.model.rings import ring_cell
    from mmp_env.model.robot import Robot, Tool
    from mmp_env.model.robot_reading import load_robot, load_tool
    from mmp_env.online.online_planner import OnlinePlanner, OnlineStep
    from mmp_env.problems.making import make_problem
    from mmp_env.problems.straight_line import straight_line
    from mmp_env.robot_folders import robot_names, tool_names
    from mmp_env.sim.camera_view import CameraView
    from mmp_env.sim.contacts import Contact
    from mmp_env.sim.execution import ExecutionReport
    from mmp_env.sim.monitor import Monitor
    from mmp_env.sim.play import play
    from mmp_env.sim.schedule_execution import execute_schedule
    from mmp_env.version import __version__
    from mmp_env.view.films import save_film
    from mmp_env.view.notebook import PlanView
    from mmp_env.view.pictures import save_picture
    from mmp_env.view.search_tree import SearchTree
    from mmp_env.work.jobs import Job, Jobs, Line, Move, Wait
    from mmp_env.work.jobs_file import load_jobs
    from mmp_env.work.object_steps import Grasp, Release
    from mmp_env.work.schedule import Schedule
    from mmp_env.work.schedule_check import check_schedule
    from mmp_env.work.schedule_file import load_schedule, save_schedule

_HOMES = {
    "model.arm": ("Arm", "Obstacle", "place_arm"),
    "model.cell": ("Cell",),
    "files.cell_file": ("load_cell",),
    "files.cell_source": ("find_cell",),
    "model.collision": ("CollisionModel",),
    "model.conflict": ("Conflict",),
    "sim.contacts": ("Contact",),
    "gym.batch": ("BatchedEnv", "batched_env"),
    "gym.env": ("MultiArmCellEnv",),
    "errors": ("InvalidInstanceError", "MmpError", "MovedBodyWarning", "UnknownNameError", "UnretimedPlanWarning"),
    "sim.execution": ("ExecutionReport",),
    "sim.camera_view": ("CameraView",),
    "view.films": ("save_film",),
    "files.instance_file": ("load_instances",),
    "gym.instances": ("draw_instance", "draw_problem"),
    "gym.parallel": ("parallel_env",),
    "importing.scene.model_cell": ("cell_from_mujoco",),
    "sim.monitor": ("Monitor",),
    "sim.play": ("play",),
    "view.notebook": ("PlanView",),
    "view.pictures": ("save_picture",),
    "model.keep": ("Upright",),
    "model.lines": ("line_cell",),
    "model.plan": ("Plan",),
    "files.plan_check": ("check_plan",),
    "files.plan_file": ("load_plan", "save_plan"),
    "model.goals": ("AnyOf", "JointGoal", "NamedGoal", "PoseGoal", "Stay"),
    "model.problem": ("Problem",),
    "online.online_planner": ("OnlinePlanner", "OnlineStep"),
    "problems.making": ("make_problem",),
    "problems.straight_line": ("straight_line",),
    "model.rings": ("ring_cell",),
    "model.robot": ("Robot", "Tool"),
    "model.robot_reading": ("load_robot", "load_tool"),
    "robot_folders": ("robot_names", "tool_names"),
    "view.search_tree": ("SearchTree",),
    "version": ("__version__",),
    "work.jobs": ("Job", "Jobs", "Line", "Move", "Wait"),
    "work.jobs_file": ("load_jobs",),
    "work.object_steps": ("Grasp", "Release"),
    "work.schedule": ("Schedule",),
    "work.schedule_check": ("check_schedule",),
    "work.schedule_file": ("load_schedule", "save_schedule"),
    "sim.schedule_execution": ("execute_schedule",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "AnyOf",
    "Arm",
    "BatchedEnv",
    "CameraView",
    "Cell",
    "CollisionModel",
    "Conflict",
    "Contact",
    "ExecutionReport",
    "Grasp",
    "InvalidInstanceError",
    "Job",
    "Jobs",
    "JointGoal",
    "Line",
    "MmpError",
    "Monitor",
    "Move",
    "MovedBodyWarning",
    "MultiArmCellEnv",
    "NamedGoal",
    "Obstacle",
    "OnlinePlanner",
    "OnlineStep",
    "Plan",
    "PlanView",
    "PoseGoal",
    "Problem",
    "Release",
    "Robot",
    "Schedule",
    "SearchTree",
    "Stay",
    "Tool",
    "UnknownNameError",
    "UnretimedPlanWarning",
    "Upright",
    "Wait",
    "__version__",
    "batched_env",
    "cell_from_mujoco",
    "check_plan",
    "check_schedule",
    "draw_instance",
    "draw_problem",
    "execute_schedule",
    "find_cell",
    "line_cell",
    "load_cell",
    "load_instances",
    "load_jobs",
    "load_plan",
    "load_robot",
    "load_schedule",
    "load_tool",
    "make_problem",
    "parallel_env",
    "place_arm",
    "play",
    "ring_cell",
    "robot_names",
    "save_film",
    "save_picture",
    "save_plan",
    "save_schedule",
    "straight_line",
    "tool_names",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'mmp_env' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"mmp_env.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


_installed = checkout.installed_package(__path__)
if _installed is None:
    register_environments()
else:
    checkout.take_place(_installed, Path(__file__).parents[1])
