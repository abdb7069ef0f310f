"""Planners for multi-arm cells: `make("apf-ecbs").plan(problem, seed=7, time_limit=60.0)` returns a `PlanResult`."""

from typing import TYPE_CHECKING, Any

from mmp_env.events import Event, Watcher, ignore
from mmp_planners.planner import Planner, PlanResult, Status, StopPlanning
from mmp_planners.registry import describe, make, names
from mmp_planners.work.scheduling import ScheduleResult, schedule

if TYPE_CHECKING:
    from mmp_env.version import __version__

__all__ = [
    "Event",
    "PlanResult",
    "Planner",
    "ScheduleResult",
    "Status",
    "StopPlanning",
    "Watcher",
    "__version__",
    "describe",
    "ignore",
    "make",
    "names",
    "schedule",
]


def __getattr__(name: str) -> Any:
    """Reads the version, which takes a moment, on first use."""
    if name != "__version__":
        raise AttributeError(f"module 'mmp_planners' has no attribute '{name}'")
    from mmp_env.version import __version__

    return __version__
