"""Where instances come from: dm_control's `random`, as the generator of Gymnasium's seeds."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.utils.seeding import np_random

from mmp_env.errors import MmpError

_SEEDS = 2**31


def generator(random: Any) -> np.random.Generator:
    """The generator that `env.reset(seed=random)` would make; a `Generator` is taken as it is, None is a fresh one.

    A `RandomState` gives a seed, the same one for the same state. Raises `MmpError` for anything else.
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
