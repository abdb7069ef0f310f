"""The environments that importing `mmp_env` registers with Gymnasium."""

from __future__ import annotations

import gymnasium

RING_COUNTS = (2, 4, 6, 8)
ANY_CELL = "MultiArmCell"
"""Takes `cell=`; `MultiArmCell-<count>` is the ring of that many UR5e, or of `robot=`."""
MAX_EPISODE_STEPS = 200
"""20 s of simulated time: every joint can cross the whole of its +-pi more than twice at the default 0.8 rad/s."""
_ENTRY_POINT = "mmp_env.env:MultiArmCellEnv"


def register_environments() -> None:
    """Registers `MultiArmCell` and `MultiArmCell-2`, `-4`, `-6`, `-8`; a second call changes nothing."""
    cells = {ANY_CELL: None} | {f"{ANY_CELL}-{count}": f"ring-{count}" for count in RING_COUNTS}
    for name, cell in cells.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point=_ENTRY_POINT,
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs={} if cell is None else {"cell": cell},
            )
