"""The rule of straight lines: a tool stays on its line, and does not turn, at every instant."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedArm
from mmp_env.check.goals import POSE_TOLERANCE_M
from mmp_env.check.model import CellModel
from mmp_env.check.schedule_motion import STRAY, Motion

LINE_TOLERANCE = 1e-3
"""Largest distance of a tool from its line [m], and of its rotation from that at the begin [rad]."""
_STEP = 0.01
"""Largest move of all joints together [rad or m] between two instants that are measured."""


def tool_pose(
    model: CellModel, arm: CheckedArm, q: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Returns position [m] and rotation of the frame of a tool, or of a flange without one; `q` is of all joints."""
    data = model.place(q)
    frame = data.body(f"{arm.name}/{arm.tool.name}") if arm.tool else data.site(f"{arm.name}/flange")
    return np.array(frame.xpos), np.array(frame.xmat).reshape(3, 3)


def off_line(
    model: CellModel, name: str, motion: Motion, window: tuple[float, float], by: Float[np.ndarray, "3"]
) -> str | None:
    """Returns words for how far a tool leaves its line; None if it stays within the tolerance at every instant.

    Args:
        model: the cell.
        name: the arm.
        motion: its motion.
        window: begin and end of the line [s].
        by: displacement of the tool [m].
    """
    arm = next(arm for arm in model.cell.arms if arm.name == name)
    first = sum(other.dof for other in model.cell.arms[: [a.name for a in model.cell.arms].index(name)])
    q = np.zeros(len(model.slides))
    rows = motion.at(instants(motion, window))
    positions, turns = [], []
    for row in rows:
        q[first : first + arm.dof] = row
        position, turn = tool_pose(model, arm, q)
        positions.append(position)
        turns.append(turn)
    room = between(model, arm, rows)
    at = np.array(positions) - positions[0]
    share = np.clip(at @ by / (by @ by), 0.0, 1.0)
    metres = float(np.linalg.norm(at - share[:, None] * by, axis=1).max()) + room
    # A rotation by an angle has a trace of 1 + 2 cos(angle); its distance from 1 is 2 sqrt(2) sin(angle / 2).
    apart = np.linalg.norm(np.array(turns) - turns[0], axis=(1, 2)).max() / (2 * np.sqrt(2))
    angle = 2 * float(np.arcsin(min(apart, 1.0))) + room
    end = float(np.linalg.norm(at[-1] - by))
    if not end <= POSE_TOLERANCE_M:
        return f"it ends {end:.3g} m from the end of the line"
    if not (metres <= LINE_TOLERANCE and angle <= LINE_TOLERANCE):
        return f"it is up to {metres:.3g} m beside the line and turns by up to {angle:.3g} rad"
    return None


def instants(motion: Motion, window: tuple[float, float]) -> Float[np.ndarray, "n"]:
    """Returns instants [s] between which the joints together move by about `_STEP` at most."""
    begin, end = (round(float(np.clip(time, 0.0, motion.end)) / motion.period) for time in window)
    if end <= begin:
        return np.array(window)
    moves = np.abs(np.diff(motion.at(motion.period * np.arange(begin, end + 1)), axis=0)).sum(axis=1)
    parts = np.maximum(np.ceil(moves / _STEP).astype(int), motion.parts()[begin:end])
    inner = [motion.period * (begin + k + np.arange(n) / n) for k, n in enumerate(parts)]
    return np.concatenate([*inner, [motion.period * end]])


def between(model: CellModel, arm: CheckedArm, rows: Float[np.ndarray, "n dof"], beyond: float = 0.0) -> float:
    """Returns how much farther the tool may be from its line, or turned, between two instants [m or rad].

    The same holds for a point that is up to `beyond` [m] from the frame of the tool, and how far it is from its chord.

    A function of an interval is at most an eighth of its largest second derivative from its chord. That of the tool's
    position is at most (sum of moves)^2 times the reach, or times 1 for a rotation and a slide.
    """
    if arm.tool:
        body, point = model.mujoco.body(f"{arm.name}/{arm.tool.name}").id, np.zeros((1, 3))
    else:
        site = model.mujoco.site(f"{arm.name}/flange")
        body, point = int(site.bodyid[0]), np.array(site.pos)[None]
    reach = max(float(model.reaches(body, point, np.full(1, beyond)).max()), 1.0)
    moved = float(np.abs(np.diff(rows, axis=0)).sum(axis=1).max(initial=0.0))
    return 2 * reach * moved * moved / 8 + STRAY * reach * arm.dof
