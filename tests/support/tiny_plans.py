"""Small plans in the form of plan.json, for tests of programs that read plans."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

UPRIGHT = [0.0, -1.5708, 0.0, -1.5708, 0.0, 0.0]
"""Configuration of a UR5e that stands upright."""
REACHING = [0.0, -0.6, 0.3, -1.2, 0.0, 0.0]
"""Configuration of a UR5e that reaches out: its wrist is 0.8 m along -x from the base, and 0.5 m above it."""


def arm(name: str, position: list[float], *, robot: str = "ur5e", yaw: float = 0.0, tool: str | None = None) -> dict:
    return {"name": name, "robot": robot, "tool": tool, "position": position, "yaw": yaw}


def plan(
    arms: list[dict],
    positions: dict[str, list[list[float]]],
    *,
    times: list[float] | None = None,
    obstacles: list[dict] | None = None,
    spheres: str = "28",
    margin: float = 0.002,
    **more: Any,
) -> dict[str, Any]:
    """Returns a plan.json whose start and goal are the ends of `positions`; without times, at 0.8 rad/s."""
    if times is None:
        longest = np.max([np.abs(np.diff(rows, axis=0)).max(axis=1) for rows in positions.values()], axis=0)
        times = [0.0, *np.cumsum(np.maximum(longest / 0.8, 0.1)).tolist()]
    problem = {
        "name": "tiny",
        "cell": {"name": "tiny", "spheres": spheres, "arms": arms, "obstacles": obstacles or []},
        "start": {name: rows[0] for name, rows in positions.items()},
        "goal": {name: rows[-1] for name, rows in positions.items()},
        "max_velocity": 0.8,
        "margin": margin,
    }
    out = {"schema": "mmp-plan/1", "problem": problem, "times": times, "positions": positions}
    return copy_of(out | {"planner": {}, "stats": {}} | more)


def copy_of(plan: dict[str, Any]) -> dict[str, Any]:
    """Returns a copy in which no two places share a list, so tests can change one of them."""
    return json.loads(json.dumps(plan))


def two_apart() -> dict[str, Any]:
    """Returns a valid plan of two UR5e 3 m apart on the ground, with two simple moves each."""
    via = [0.3, -1.3, 0.4, -1.5, 0.2, -0.4]
    return plan(
        [arm("left", [-1.5, 0.0, 0.0]), arm("right", [1.5, 0.0, 0.0], yaw=3.0)],
        {"left": [UPRIGHT, via, REACHING], "right": [REACHING, via, UPRIGHT]},
        obstacles=[{"name": "ground", "shape": "box", "size": [5.0, 2.0, 0.1], "position": [0.0, 0.0, -0.05]}],
    )
