"""The task of a cell for dm_control: from start to goal without touching, as in the Gymnasium environment."""

from __future__ import annotations

from typing import Any

import numpy as np
from dm_control.rl import control
from dm_env import specs
from jaxtyping import Float

from mmp_env.dm.physics import CellPhysics
from mmp_env.errors import MmpError
from mmp_env.gym.cell_instance import CellInstance, InstanceSource
from mmp_env.gym.control import ControlMode, checked_action, steps_per_action
from mmp_env.gym.observation import Observer, joint_limits
from mmp_env.gym.reward import GoalProgress, measured
from mmp_env.model.cell import Cell
from mmp_env.model.problem import Problem
from mmp_env.model.task import State
from mmp_env.sim.contacts import Contact
from mmp_env.sim.simulation import Simulation


class CellTask(control.Task):
    """Instances, actions, observations, reward and end of `MultiArmCell`.

    `contacts` are those of the last action.

    Args:
        simulation: the simulation of the environment.
        source: the source of the instances, one per episode.
        random: the source of all random numbers.
        control_mode: as in `MultiArmCell`, like the other options.
    """

    def __init__(
        self,
        simulation: Simulation,
        source: InstanceSource,
        random: np.random.Generator,
        *,
        control_mode: str,
        terminate_on_contact: bool,
        control_rate_hz: int,
    ) -> None:
        self.random = random
        self.steps = steps_per_action(control_rate_hz, simulation.timestep_s)
        """Physics steps for each action."""
        self.contacts: list[Contact] = []
        self._source = source
        self._instance: CellInstance | None = None
        self._terminate_on_contact = terminate_on_contact
        lower, upper = joint_limits(source.cell)
        reach = source.fastest / control_rate_hz
        self.mode = ControlMode(name=control_mode, lower=lower, upper=upper, reach=reach)
        self._observer: Observer | None = None
        self._progress = GoalProgress(simulation.positions, simulation.positions)
        self._reference = self._progress.reference
        self._reward = 0.0

    @property
    def instance(self) -> CellInstance:
        """The present instance. Raises `MmpError` before the first episode."""
        if self._instance is None:
            raise MmpError("no episode has begun; call reset() of the environment first")
        return self._instance

    @property
    def cell(self) -> Cell:
        """The cell of the present episode, with the objects of its task."""
        return self._source.cell if self._instance is None else self._instance.cell

    @property
    def start(self) -> State:
        """Start of the present episode, arm name -> [dof] [rad]."""
        return self.instance.start

    @property
    def goal(self) -> State:
        """Goal of the present episode, arm name -> [dof] [rad]."""
        return self.instance.goal

    @property
    def problem(self) -> Problem:
        """The present instance as a problem. Raises `InvalidInstanceError` if a task drew a bad one."""
        return self.instance.problem

    @property
    def distance_rad(self) -> float:
        """Largest distance of a joint to its goal [rad]."""
        return self._progress.distance_rad

    @property
    def is_success(self) -> bool:
        """Whether every joint has reached its goal."""
        return self._progress.is_success

    def initialize_episode(self, physics: CellPhysics) -> None:
        """Draws the next instance with the objects of its task, and puts the arms at rest at its start."""
        instance = self._source.drawn(self.random)
        if instance.cell is not physics.simulation.cell:
            physics.enter(instance.cell)
            self._observer = None
        self._instance = instance
        simulation = physics.simulation
        simulation.place(simulation.joined(instance.start))
        self._progress = GoalProgress(simulation.positions, simulation.joined(instance.goal))
        self.contacts, self._reward = [], 0.0

    def before_step(self, action: Any, physics: CellPhysics) -> None:
        """Gives the servos their reference. Raises `MmpError` for an action of the wrong shape or not finite."""
        simulation = physics.simulation
        begin, end = self.mode.reference(
            checked_action(action, simulation.count), self._progress.q, self._progress.reference
        )
        simulation.log.clear()
        simulation.set_reference(begin, end, self.steps)
        self._reference = end

    def after_step(self, physics: CellPhysics) -> None:
        """Reads positions, contacts and reward after the action."""
        simulation = physics.simulation
        self.contacts = simulation.log.contacts
        q = simulation.positions
        distance = measured(q, self._progress.target)
        self._reward = self._progress.update(q, self._reference, distance=distance, contact=bool(self.contacts))

    def get_reward(self, physics: CellPhysics) -> float:
        return self._reward

    def get_termination(self, physics: CellPhysics) -> float | None:
        """Returns discount 0 at the goal and after a contact that ends the episode, otherwise None."""
        return 0.0 if self.is_success or (self._terminate_on_contact and self.contacts) else None

    def get_observation(self, physics: CellPhysics) -> dict[str, Float[np.ndarray, "..."]]:
        """Returns the observation of the Gymnasium environment."""
        return self._observed(physics).observe(self._progress.target)

    def action_spec(self, physics: CellPhysics) -> specs.BoundedArray:
        """Returns a spec of one number in [-1, 1] per servo, named after the servos, with tabs in between."""
        names = [physics.model.id2name(k, "actuator") for k in range(physics.model.nu)]
        return specs.BoundedArray((len(names),), np.float64, minimum=-1.0, maximum=1.0, name="\t".join(names))

    def observation_spec(self, physics: CellPhysics) -> dict[str, specs.BoundedArray]:
        """Returns the bounds of the space of the Gymnasium environment."""
        return {
            name: specs.BoundedArray(box.shape, box.dtype, minimum=box.low, maximum=box.high, name=name)
            for name, box in self._observed(physics).boxes.items()
        }

    def __getstate__(self) -> dict[str, Any]:
        # A copy observes the physics of its own environment.
        return {**vars(self), "_observer": None}

    def _observed(self, physics: CellPhysics) -> Observer:
        if self._observer is None:
            self._observer = Observer(physics.simulation)
        return self._observer
