"""Makes a cell a multi-agent environment of PettingZoo, with one agent per arm. It needs the extra `learning`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium

from mmp_env.argument_checks import whole
from mmp_env.errors import MmpError
from mmp_env.gym.registration import MAX_EPISODE_STEPS, known_id

if TYPE_CHECKING:
    from mmp_env.gym.parallel_cell import ParallelCellEnv


def parallel_env(id: str, *, max_episode_steps: int = MAX_EPISODE_STEPS, **options: Any) -> ParallelCellEnv:
    """Returns a PettingZoo `ParallelEnv` in which each arm of the cell is an agent.

    Args:
        id: id of an environment, such as `MultiArmCell-4`; `MultiArmCell` takes `cell=`.
        max_episode_steps: number of actions after which an episode is truncated.
        **options: the options of `MultiArmCellEnv`.

    Raises:
        MmpError: for an unknown id or option, a bad value, or if PettingZoo is missing.
    """
    id = known_id(id)
    steps = whole("max_episode_steps", max_episode_steps, 1)
    try:
        from mmp_env.gym.parallel_cell import ParallelCellEnv
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "pettingzoo":
            raise
        raise MmpError("parallel_env needs PettingZoo; get it with: pip install 'mmp-env[learning]'") from None
    return ParallelCellEnv(gymnasium.make(id, max_episode_steps=steps, disable_env_checker=True, **options), name=id)
