"""The random generator of an environment, from the argument `random` of dm_control."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.utils.seeding import np_random

from mmp_env.errors import MmpError

_SEEDS = 2**31


def generator(random: Any) -> np.random.Generator:
    """Returns the generator of `env.reset(seed=random)`, a given `Generator` itself, or a fresh one for None.

    The same state of a `RandomState` gives the same generator. Raises `MmpError` for anything else.
    """
    if isinstance(random, np.random.Generator):
        return random
    if isinstance(random, np.random.RandomState):
        random = int(random.randint(_SEEDS))
    if random is not None and (isinstance(random, bool) or not isinstance(random, int | np.integer) or random < 0):
        raise MmpError(
            f"random is {random!r}; it must be a whole number from 0, a numpy Generator or RandomState, or None"
        )
    return np_random(None if random is None else int(random))[0]
