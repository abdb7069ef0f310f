"""The cells as dm_control environments (extra `dm`): the same names, instances, observations and rewards.

    environment = mmp_env.dm.load("MultiArmCell-4", task="reach", random=7)  # the instance of env.reset(seed=7)
    time_step = environment.reset()

`load` imports dm_control; importing this package does not.
docs/how-to/dm-control.md explains the environments.
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from mmp_env.dm.control_suite import require
from mmp_env.errors import UnknownNameError
from mmp_env.gym.control import CONTROL_RATE_HZ
from mmp_env.gym.environment_options import check_options
from mmp_env.gym.instances import DEFAULT_TASK
from mmp_env.gym.registration import ANY_CELL, CELLS
from mmp_env.model.cell import Cell
from mmp_env.model.plan_fit import given_plan
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY
from mmp_env.model.task import Task

if TYPE_CHECKING:
    import dm_env

    from mmp_env.dm.following import Follower
    from mmp_env.gym.cell_instance import Margin
    from mmp_env.model.plan import Plan

__all__ = ["follow", "load", "require"]

TIME_LIMIT_S = 20.0
"""Simulated time of an episode, the same as in Gymnasium."""


def load(
    source: Cell | str | PathLike[str] = "MultiArmCell-4",
    task: str | Task = DEFAULT_TASK,
    random: Any = None,
    *,
    robot: str | None = None,
    spheres: str | int | None = None,
    control_mode: str = "position",
    terminate_on_contact: bool = True,
    self_contacts: bool = True,
    max_velocity: float = DEFAULT_MAX_VELOCITY,
    margin: Margin = None,
    control_rate_hz: int = CONTROL_RATE_HZ,
    time_limit: float = TIME_LIMIT_S,
) -> dm_env.Environment:
    """Returns a `dm_control.rl.control.Environment` of a cell, like `dm_control.suite.load`.

    The other options are those of `MultiArmCell`. If the task puts objects into the cell, each episode has its own
    model.

    Args:
        source: an environment id, or a cell as `MultiArmCell` takes it.
        task: the task that draws the instances, or its name.
        random: a seed, a NumPy `Generator` or `RandomState`, or None. The first episode of seed N is the instance of
            `env.reset(seed=N)`, the next ones are those of further `env.reset()`.
        margin: margin of `environment.task.problem`; an episode whose start or goal is closer is refused.
        time_limit: simulated time of an episode [s].

    Raises:
        MmpError: for an unknown option or a bad value, or without a dm_control that works.
    """
    check_options(
        {
            "robot": robot,
            "spheres": spheres,
            "control_mode": control_mode,
            "terminate_on_contact": terminate_on_contact,
            "self_contacts": self_contacts,
            "control_rate_hz": control_rate_hz,
            "time_limit": time_limit,
        }
    )
    require()
    from dm_control.rl import control

    from mmp_env.dm.physics import CellPhysics
    from mmp_env.dm.random_source import generator
    from mmp_env.dm.task import CellTask
    from mmp_env.files.cell_source import find_cell
    from mmp_env.gym.cell_instance import InstanceSource

    cell = find_cell(_named(source), robot=robot, spheres=None if spheres is None else str(spheres))
    physics = CellPhysics.of(cell, self_contacts=self_contacts)
    cell_task = CellTask(
        physics.simulation,
        InstanceSource(cell, task, max_velocity, margin),
        generator(random),
        control_mode=control_mode,
        terminate_on_contact=terminate_on_contact,
        control_rate_hz=control_rate_hz,
    )
    return control.Environment(physics, cell_task, time_limit=time_limit, n_sub_steps=cell_task.steps)


def follow(environment: dm_env.Environment, plan: Plan | None) -> Follower:
    """Returns a policy that moves the arms along a plan, for loops over `step` and for dm_control's viewer.

    Args:
        environment: an environment of `load` with `control_mode="position"`.
        plan: a plan for its cell. None, the result of a failed planner, is an error.

    Raises:
        MmpError: for another control mode, a plan of another cell, or None.
    """
    plan = given_plan(plan, "follow")
    from mmp_env.dm.following import Follower

    return Follower(environment, plan)


def _named(source: Cell | str | PathLike[str]) -> Cell | str | PathLike[str]:
    """Returns the name of the cell of an environment id, and any other source unchanged."""
    if not isinstance(source, str) or not source.startswith(ANY_CELL):
        return source
    if source not in CELLS:
        raise UnknownNameError("environment id", source, CELLS)
    return CELLS[source]
