"""The task of a cell for dm_control: from start to goal without touching, as in the Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from dm_control.rl import control
from dm_env import specs
from jaxtyping import Float

from mmp_env.contacts import Contact
from mmp_env.control import checked_action, find_control_mode, steps_per_action
from mmp_env.dm.physics import CellPhysics
from mmp_env.errors import MmpError
from mmp_env.execution import REACHED_RAD
from mmp_env.instances import Source, draw, find_task
from mmp_env.observation import Observer, joint_limits
from mmp_env.problem import Problem, make_problem, velocity_limits
from mmp_env.reward import step_reward
from mmp_env.simulation import Simulation


class CellTask(control.Task):
    """Instances, actions, observations, reward and end of `MultiArmCell`; options as there.

    `random` is drawn from at the beginning of each episode. Of the present one: `start`, `goal` (arm name -> [dof]
    [rad]), `contacts` of the last action, `is_success`, `distance_rad` (largest over joints).
    """

    def __init__(
        self,
        simulation: Simulation,
        task: str | Source,
        random: np.random.Generator,
        *,
        control_mode: str,
        terminate_on_contact: bool,
        max_velocity: float,
        control_rate_hz: int,
    ) -> None:
        self.cell = simulation.cell
        self.random = random
        self.steps = steps_per_action(control_rate_hz, simulation.timestep_s)
        """Physics steps for each action."""
        self.start: Mapping[str, Float[np.ndarray, " dof"]] = {}
        self.goal: Mapping[str, Float[np.ndarray, " dof"]] = {}
        self.contacts: list[Contact] = []
        self._source = find_task(task)
        self._max_velocity = max_velocity
        self._terminate_on_contact = terminate_on_contact
        fastest = np.concatenate(list(velocity_limits(self.cell, max_velocity).values()))
        lower, upper = joint_limits(self.cell)
        self.mode = find_control_mode(control_mode)(lower=lower, upper=upper, reach=fastest / control_rate_hz)
        self._observer = Observer(simulation)
        self._target = self._q = self._reference = simulation.positions
        self._reward = 0.0

    @property
    def problem(self) -> Problem:
        """The present instance as planners take it. Raises `InvalidInstanceError` for a bad task."""
        return make_problem(self.cell, self.start, self.goal, max_velocity=self._max_velocity)

    @property
    def distance_rad(self) -> float:
        return float(np.abs(self._target - self._q).max())

    @property
    def is_success(self) -> bool:
        return self.distance_rad <= REACHED_RAD

    def initialize_episode(self, physics: CellPhysics) -> None:
        """Draws the next instance and puts the arms at rest at its start."""
        simulation = physics.simulation
        drawn = draw(self.cell, self._source, self.random)
        if drawn.cell is not self.cell:
            raise MmpError("the task puts objects into the cell, and this environment has one model for all episodes")
        self.start, self.goal = drawn.start, drawn.goal
        simulation.place(simulation.joined(self.start))
        self._target = simulation.joined(self.goal)
        self._q = self._reference = simulation.positions
        self.contacts, self._reward = [], 0.0

    def before_step(self, action: Any, physics: CellPhysics) -> None:
        """Gives the servos their reference. Raises `MmpError` for an action of the wrong shape or not finite."""
        simulation = physics.simulation
        begin, end = self.mode.reference(checked_action(action, simulation.count), self._q, self._reference)
        simulation.log.clear()
        simulation.aim(begin, end, self.steps)
        self._reference = end

    def after_step(self, physics: CellPhysics) -> None:
        """What has become of the action."""
        simulation = physics.simulation
        before = self._mean_distance
        self._q, self.contacts = simulation.positions, simulation.log.contacts
        progress = before - self._mean_distance
        self._reward = step_reward(progress, success=self.is_success, contact=bool(self.contacts))

    def get_reward(self, physics: CellPhysics) -> float:
        return self._reward

    def get_termination(self, physics: CellPhysics) -> float | None:
        """0 at the goal, and after a contact unless that is allowed; None where the episode goes on."""
        return 0.0 if self.is_success or (self._terminate_on_contact and self.contacts) else None

    def get_observation(self, physics: CellPhysics) -> dict[str, Float[np.ndarray, "..."]]:
        """As in the Gymnasium environment."""
        return self._observer.observe(self._q, self._target)

    def action_spec(self, physics: CellPhysics) -> specs.BoundedArray:
        """One number in [-1, 1] for each servo, whose names are that of the spec, with tabs between them."""
        names = [physics.model.id2name(k, "actuator") for k in range(physics.model.nu)]
        return specs.BoundedArray((len(names),), np.float64, minimum=-1.0, maximum=1.0, name="\t".join(names))

    def observation_spec(self, physics: CellPhysics) -> dict[str, specs.BoundedArray]:
        """The bounds of the Gymnasium environment's space."""
        return {
            name: specs.BoundedArray(box.shape, box.dtype, minimum=box.low, maximum=box.high, name=name)
            for name, box in self._observer.boxes.items()
        }

    @property
    def _mean_distance(self) -> float:
        return float(np.abs(self._target - self._q).mean())
