"""Planners for multi-arm cells. `make("apf-ecbs").plan(problem, seed=7, time_limit=60.0)` is all one needs."""

from mmp_env.events import Event, Watcher, ignore
from mmp_planners.planner import Planner, PlanResult, Status, StopPlanning
from mmp_planners.registry import describe, make, names

__all__ = [
    "Event",
    "PlanResult",
    "Planner",
    "Status",
    "StopPlanning",
    "Watcher",
    "describe",
    "ignore",
    "make",
    "names",
]
