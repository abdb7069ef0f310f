"""Tasks: rules that draw start and goal. A task is registered under the entry-point group `mmp_env.tasks`."""

from mmp_env.model.task import State, Task
from mmp_tasks.registry import TaskDescription, describe, make, names

__all__ = ["State", "Task", "TaskDescription", "describe", "make", "names"]
