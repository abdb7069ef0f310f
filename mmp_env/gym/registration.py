"""Registration of the environments with Gymnasium, which importing `mmp_env` does."""

from __future__ import annotations

import gymnasium

from mmp_env.errors import UnknownNameError

RING_COUNTS, LINE_COUNTS = (2, 4, 6, 8), (10, 12, 16, 24, 32, 48, 64)
ANY_CELL = "MultiArmCell"
"""Id of the environment that takes `cell=`. `MultiArmCell-<count>` is a ring, or from 10 on two rows, of that many UR5e
or `robot=`."""
CELLS = (
    {f"{ANY_CELL}-{count}": f"ring-{count}" for count in RING_COUNTS}
    | {f"{ANY_CELL}-{count}": f"line-{count}" for count in LINE_COUNTS}
    | {f"{ANY_CELL}-mixed-4": "mixed-4"}
)
"""Environment id -> name of its cell."""
MAX_EPISODE_STEPS = 200
"""Actions in an episode: 20 s, in which every joint can cross its range of 2 pi twice at the default 0.8 rad/s."""
_ENTRY_POINT = "mmp_env.gym.env:MultiArmCellEnv"


def register_environments() -> None:
    """Registers `MultiArmCell` and the ids in `CELLS`; a second call changes nothing."""
    for name, cell in ({ANY_CELL: None} | CELLS).items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point=_ENTRY_POINT,
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs={} if cell is None else {"cell": cell},
            )


def known_id(id: str) -> str:
    """Returns an environment id without the `mmp_env:` that may precede it. Raises `UnknownNameError`."""
    name = id.removeprefix("mmp_env:") if isinstance(id, str) else id
    known = (ANY_CELL, *CELLS)
    if name not in known:
        raise UnknownNameError("environment", name, known)
    return name
