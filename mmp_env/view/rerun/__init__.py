"""Recordings for the rerun viewer: conflict trees, sphere clouds and moving cells (extra `rerun`).

    with RerunWatcher(problem, "search.rrd") as watcher:
        result = mmp_planners.make("apf-ecbs").plan(problem, watch=watcher)
        watcher.show_plan(result.plan)

rerun is imported when a recording begins, not with this package. docs/how-to/rerun.md explains the views.
"""

from mmp_env.view.rerun.recorder import RerunRecorder
from mmp_env.view.rerun.sdk import require
from mmp_env.view.rerun.single_arm import GrownTree, record_single_arm
from mmp_env.view.rerun.watcher import RerunWatcher

__all__ = ["GrownTree", "RerunRecorder", "RerunWatcher", "record_single_arm", "require"]
