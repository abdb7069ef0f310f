"""A cell as a `ParallelEnv` of PettingZoo (Terry et al. 2021): the agents are its arms, and all of them act at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import gymnasium
import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from mmp_env.argument_checks import as_numbers, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.env import MultiArmCellEnv, Observation

OWN = ("joint_positions", "joint_velocities", "goal_positions")
"""Quantities that an agent observes of its own joints alone. It observes all other quantities of the whole cell."""
PROBE = {"options": 1}
"""Reset options that the API test of PettingZoo sends. They ask for nothing."""
Value = TypeVar("Value")


class ParallelCellEnv(ParallelEnv[str, Any, Any]):
    """The environment of a cell with one agent per arm, named like the arm.

    All agents share the reward of the cell, and their episode ends together. An agent observes the `joint_positions`,
    `joint_velocities` and `goal_positions` of its own joints [dof], and the `tool_positions` and `clearance` of the
    cell. Its action is [dof] numbers in [-1, 1]. Its info is that of the cell, but with `distance_rad` of its joints,
    and the `contacts` that its arm takes part in.

    Args:
        env: the environment of the cell.
        name: name in `metadata`.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], *, name: str) -> None:
        self._env = env
        cell = self.cell_env.cell
        self.possible_agents = list(cell.arm_names)
        self.agents: list[str] = []
        self.render_mode = env.render_mode
        self.metadata = {**self.cell_env.metadata, "name": name, "is_parallelizable": True}
        ends = np.cumsum([arm.dof for arm in cell.arms])
        self._joints = {arm.name: slice(int(end) - arm.dof, int(end)) for arm, end in zip(cell.arms, ends, strict=True)}
        boxes: Mapping[str, spaces.Box] = self.cell_env.observation_space.spaces  # type: ignore[attr-defined]
        self.observation_spaces: dict[str, spaces.Space[Any]] = {
            agent: spaces.Dict(self._seen_by(agent, boxes, _part_of_box)) for agent in self._joints
        }
        self.action_spaces: dict[str, spaces.Space[Any]] = {
            agent: spaces.Box(-1.0, 1.0, (part.stop - part.start,), np.float32) for agent, part in self._joints.items()
        }

    @property
    def unwrapped(self) -> ParallelCellEnv:
        """This environment."""
        return self

    @property
    def cell_env(self) -> MultiArmCellEnv:
        """The environment of the whole cell, with `problem`, `execute`, and the model and data of MuJoCo."""
        env = self._env.unwrapped
        assert isinstance(env, MultiArmCellEnv)
        return env

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of what an agent observes."""
        return self.observation_spaces[self._known(agent)]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of the actions of an agent."""
        return self.action_spaces[self._known(agent)]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Puts the arms at rest at the start of the next instance, as `MultiArmCellEnv.reset` does.

        Returns:
            Observation and info of each agent.

        Raises:
            MmpError: for a bad seed or bad options.
        """
        observation, info = self._env.reset(seed=seed, options=None if options == PROBE else options)
        self.agents = list(self.possible_agents)
        return self._observations(observation), self._infos(observation, info)

    def step(
        self, actions: Any
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Moves all arms for one control period.

        Args:
            actions: agent -> [dof] numbers in [-1, 1], for every agent.

        Returns:
            Observation, reward, terminated, truncated and info of each agent. After the end `agents` is empty.

        Raises:
            MmpError: for actions that are no mapping, a missing or unknown agent, or an action of the wrong shape.
        """
        if not self.agents:
            raise gymnasium.error.ResetNeeded("the episode has not begun or is over; call reset() first")
        if not isinstance(actions, Mapping):
            raise refused(
                "actions", actions, f"a mapping of each agent to its action: {', '.join(self.possible_agents)}"
            )
        for agent in actions:
            self._known(agent)
        joined = [self._action(agent, actions) for agent in self.possible_agents]
        observation, reward, terminated, truncated, info = self._env.step(np.concatenate(joined))
        outcome = (
            self._observations(observation),
            self._each(float(reward)),
            self._each(terminated),
            self._each(truncated),
            self._infos(observation, info),
        )
        if terminated or truncated:
            self.agents = []
        return outcome

    def render(self) -> Any:
        """Returns a picture or updates the window, as `MultiArmCellEnv.render` does."""
        return self._env.render()

    def close(self) -> None:
        """Closes window and renderer."""
        self._env.close()

    def _known(self, agent: str) -> str:
        if agent not in self._joints:
            raise UnknownNameError("agent", agent, self.possible_agents)
        return agent

    def _action(self, agent: str, actions: Mapping[str, Any]) -> np.ndarray:
        if agent not in actions:
            raise MmpError(f"there is no action for {agent}; an action is needed for {', '.join(self.possible_agents)}")
        action, shape = as_numbers(actions[agent]), self.action_spaces[agent].shape
        if action is None:
            raise refused(f"the action of {agent}", actions[agent], "numbers from -1 to 1")
        if action.shape != shape:
            raise MmpError(f"the action of {agent} has the shape {action.shape}; it must be {shape}")
        return action

    def _each(self, value: Value) -> dict[str, Value]:
        return dict.fromkeys(self.possible_agents, value)

    def _seen_by(self, agent: str, whole: Mapping[str, Any], part_of: Any) -> dict[str, Any]:
        """Returns what an agent observes of the quantities of the cell."""
        return {key: part_of(value, self._joints[agent]) if key in OWN else value for key, value in whole.items()}

    def _observations(self, whole: Observation) -> dict[str, Observation]:
        return {
            agent: {key: value.copy() for key, value in self._seen_by(agent, whole, np.ndarray.__getitem__).items()}
            for agent in self.possible_agents
        }

    def _infos(self, whole: Observation, info: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        distances = np.abs(whole["goal_positions"] - whole["joint_positions"])
        return {
            agent: {
                **info,
                "distance_rad": float(distances[joints].max()),
                "contacts": [c for c in info["contacts"] if agent in (_arm(c.body_a), _arm(c.body_b))],
            }
            for agent, joints in self._joints.items()
        }


def _part_of_box(box: spaces.Box, joints: slice) -> spaces.Box:
    return spaces.Box(box.low[joints], box.high[joints], dtype=np.float64)


def _arm(body: str) -> str:
    return body.partition("/")[0]
