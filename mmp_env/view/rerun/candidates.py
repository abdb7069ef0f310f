"""The candidates of each arm's goal as translucent ghosts, for all times; the chosen one is marked."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from jaxtyping import Int

from mmp_env.model.problem import Problem
from mmp_env.view.rerun.colors import BEFORE, CHOSEN
from mmp_env.view.rerun.geoms import CellGeoms
from mmp_env.view.rerun.sdk import entity_part, require

CANDIDATES = "/candidates"
MOST_SHOWN = 8
"""Largest number of candidates of an arm that a recording shows."""
_GHOST_ALPHA, _CHOSEN_ALPHA = 50, 150
"""Opacity of ghosts, of 255."""


def shown_candidates(problem: Problem, arm: str) -> tuple[Int[np.ndarray, "k"], int]:
    """Returns the candidates of an arm that are shown, nearest first, and the chosen one, as rows of `goals`."""
    chosen = int(np.abs(problem.goals[arm] - problem.goal[arm]).sum(axis=1).argmin())
    shown = np.arange(min(MOST_SHOWN, len(problem.goals[arm])))
    if chosen not in shown:
        shown[-1] = chosen
    return shown, chosen


def send_candidates(stream: Any, problem: Problem, model: Any) -> None:
    """Logs `/candidates/<arm>/<k>` for row k of `problem.goals` of each arm with several; the chosen one has a label.

    Args:
        stream: the recording.
        problem: the problem, with the goals that the planner chose.
        model: the compiled cell.
    """
    rerun, looks = require(), {}
    for is_chosen, rgba in ((False, (*BEFORE, _GHOST_ALPHA)), (True, (*CHOSEN, _CHOSEN_ALPHA))):
        looks[is_chosen] = ghost = copy(model)
        ghost.geom_matid[:] = -1
        ghost.geom_rgba[:] = np.array(rgba) / 255
    for arm in problem.cell.arm_names:
        if len(problem.goals[arm]) < 2:
            continue
        shown, chosen = shown_candidates(problem, arm)
        for k in shown.tolist():
            root, q = f"{CANDIDATES}/{entity_part(arm)}/{k}", problem.goals[arm][k]
            state = np.concatenate([q if name == arm else problem.goal[name] for name in problem.cell.arm_names])
            CellGeoms(stream, problem.cell, looks[k == chosen], arm=arm, root=root).log_pose(state)
            if k == chosen:
                tool = problem.cell.collision.tool_points(arm, q[None])
                stream.log(
                    f"{root}/label",
                    rerun.Points3D(tool, radii=0.01, colors=[CHOSEN], labels=[f"{arm}: goal"], show_labels=True),
                    static=True,
                )
