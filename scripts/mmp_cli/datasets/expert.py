"""Expert episodes: an environment whose actions follow a plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.retime import retime
from mmp_env.sim.servo_reference import Reference

PATIENCE = 20
"""Actions after the end of the plan within which the goal must be reached."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Episode:
    """What happened in an environment, step after step.

    Attributes:
        observations: name -> [t + 1, ...]; the first one is that of `reset`.
        actions: [t, n].
        rewards: [t].
        infos: name -> [t]: `is_success`, `distance_rad`, and `contacts`, their number.
    """

    observations: dict[str, np.ndarray]
    actions: np.ndarray
    rewards: Float[np.ndarray, "t"]
    infos: dict[str, np.ndarray]

    @property
    def steps(self) -> int:
        """Number of actions."""
        return len(self.actions)

    @property
    def is_success(self) -> bool:
        """Whether the goal was reached without contact."""
        return bool(self.infos["is_success"][-1])

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all arrays by the names that files have."""
        ended = np.zeros(self.steps, dtype=bool)
        ended[-1] = True
        return (
            {f"observations.{name}": rows for name, rows in self.observations.items()}
            | {"actions": self.actions, "rewards": self.rewards}
            | {"terminations": ended & self.is_success, "truncations": ended & (not self.is_success)}
            | {f"infos.{name}": rows for name, rows in self.infos.items()}
        )


def follow(env: MultiArmCellEnv, problem: Problem, plan: Plan) -> Episode:
    """Returns the episode in which the actions follow a plan, retimed, and end at its goal.

    Args:
        env: an environment of the cell of the problem.
        problem: the instance.
        plan: a plan of it that is not retimed.

    Raises:
        MmpError: for a plan that cannot be retimed.
    """
    if plan.cost_rad == 0:
        raise MmpError("the plan moves no arm")
    reference = Reference(retime(plan), problem.start)
    observation, _ = env.reset(options={"start": problem.start, "goal": plan.problem.goal})
    count = int(np.ceil(reference.end_s * env.metadata["render_fps"]))
    wanted, _ = reference.at(np.arange(1, count + PATIENCE + 1) / env.metadata["render_fps"])
    observations, actions, rewards = [observation], [], []
    infos: dict[str, list[float | bool]] = {"is_success": [], "distance_rad": [], "contacts": []}
    for q in wanted:
        action = env.action_towards(q)
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        actions.append(action)
        rewards.append(reward)
        for name, values in infos.items():
            values.append(len(info[name]) if name == "contacts" else info[name])
        if terminated or truncated:
            break
    return Episode(
        observations={name: np.array([each[name] for each in observations]) for name in observation},
        actions=np.array(actions),
        rewards=np.array(rewards),
        infos={name: np.array(values) for name, values in infos.items()},
    )
