"""When each arm moves, waits, or has arrived, as a strip per arm."""

from __future__ import annotations

from typing import Any

import numpy as np

from mmp_env.model.plan import Plan
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.colors import curve_colors
from mmp_env.view.rerun.sdk import entity_part, require

MOTION_STATES = "/moving"
MOVING, WAITING, ARRIVED = "moves", "waits", "has arrived"
_WAITING, _ARRIVED = (140, 140, 140), (98, 98, 98)
_STILL_RAD_S = 1e-3
"""Largest joint velocity [rad/s] of an arm that counts as standing still."""


def send_motion_states(stream: Any, plan: Plan) -> None:
    """Sends the state changes of each arm."""
    rerun = require()
    for arm, color in curve_colors(plan.problem.cell).items():
        path = f"{MOTION_STATES}/{entity_part(arm)}"
        stream.log(
            path,
            rerun.StateConfiguration(
                values=[MOVING, WAITING, ARRIVED],
                labels=[MOVING, WAITING, ARRIVED],
                colors=[[*color, 255], [*_WAITING, 255], [*_ARRIVED, 255]],
            ),
            static=True,
        )
        changes = state_changes(plan, arm)
        index = [timelines.seconds([time for time, _ in changes])]
        stream.send_columns(path, index, rerun.StateChange.columns(state=[state for _, state in changes]))


def state_changes(plan: Plan, arm: str) -> list[tuple[float, str]]:
    """Returns (time [s], state) at the start, at each change of state, and at the end of the plan."""
    q, times = plan.positions[arm], plan.times
    moves = np.abs(np.diff(q, axis=0)).max(axis=1) > _STILL_RAD_S * np.diff(times)
    arrived = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
    out: list[tuple[float, str]] = []
    for k, time in enumerate(times.tolist()):
        state = ARRIVED if k >= arrived else MOVING if moves[k] else WAITING
        if not out or out[-1][1] != state or k == len(times) - 1:
            out.append((time, state))
    return out
