"""Tasks: what start and goal instances are drawn from. Registered by the entry-point group `mmp_env.tasks`."""

from mmp_tasks.registry import TaskDescription, describe, make, names
from mmp_tasks.task import State, Task

__all__ = ["State", "Task", "TaskDescription", "describe", "make", "names"]
