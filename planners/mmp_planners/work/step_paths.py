"""Paths of the steps of jobs. A move is chosen so that the straight lines after it are possible."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.errors import InvalidInstanceError
from mmp_env.model.arm import Arm
from mmp_env.model.goals import Stay
from mmp_env.problems.straight_line import along_line
from mmp_env.work.jobs import Line, Move, Step
from mmp_planners.work.move_planner import MovePlanner

LINE_PATH_TOLERANCE = 2e-4
"""Largest distance of a tool from its line on the path of a line [m], and of its rotation [rad]."""
MOST_ENDS = 4
"""Largest number of ends of a move that a search gets if lines follow."""
MOST_TRIED = 24
"""Largest number of ends of a move, the nearest ones, from which the lines after it are tried."""


class StepPaths:
    """Finds ends and paths of steps.

    Args:
        mover: plans moves.
    """

    def __init__(self, mover: MovePlanner) -> None:
        self._mover = mover
        self._ends: dict[tuple[int, str, int, bytes], Float[np.ndarray, "n dof"]] = {}
        self._lines: dict[tuple[int, Line, bytes], Float[np.ndarray, "k dof"] | str] = {}

    def ends(
        self, arm: int, steps: Sequence[Step], near: Float[np.ndarray, "dof"], where: str, most: int = MOST_ENDS
    ) -> Float[np.ndarray, "n dof"]:
        """Returns where the first of some steps, a move, may end: free alone, and so are the lines up to the next move.

        Args:
            arm: number of the arm.
            steps: the move, and the steps after it.
            near: where the arm stands [rad, of slides m]; the nearest ends come first.
            where: begin of the messages, such as `step 1 of job 'a'`.
            most: largest number of ends if lines follow.

        Raises:
            InvalidInstanceError: if there are none.
        """
        key = arm, where, most, np.asarray(near, dtype=float).tobytes()
        if key not in self._ends:
            self._ends[key] = self._found_ends(arm, steps, near, where, most)
        return self._ends[key]

    def _found_ends(
        self, arm: int, steps: Sequence[Step], near: Float[np.ndarray, "dof"], where: str, most: int
    ) -> Float[np.ndarray, "n dof"]:
        move, lines = steps[0], lines_after(steps)
        assert isinstance(move, Move)
        goals = self._mover.goals(arm, move.goal, near, where)
        if not lines or isinstance(move.goal, Stay):
            return goals
        out: list[Float[np.ndarray, "dof"]] = []
        reason = ""
        for q in goals[:MOST_TRIED]:
            try:
                self.along_lines(arm, q, lines, where)
            except InvalidInstanceError as error:
                reason = reason or str(error)
                continue
            out.append(q)
            if len(out) == most:
                break
        if not out:
            raise InvalidInstanceError(f"{reason}; no other end of the move allows the line either")
        return np.array(out)

    def along_lines(
        self, arm: int, q: Float[np.ndarray, "dof"], lines: Sequence[Line], where: str
    ) -> Float[np.ndarray, "k dof"]:
        """Returns the path [k, dof] along some lines, free alone. Raises `InvalidInstanceError` if there is none."""
        rows = [np.array(q)[None]]
        for line in lines:
            rows.append(self.line(arm, rows[-1][-1], line, where)[1:])
        return np.concatenate(rows)

    def line(self, arm: int, q: Float[np.ndarray, "dof"], line: Line, where: str) -> Float[np.ndarray, "k dof"]:
        """Returns the path [k, dof] along a line, free alone.

        Args:
            arm: number of the arm.
            q: where it begins [dof].
            line: the step.
            where: begin of the messages.

        Raises:
            InvalidInstanceError: if the arm cannot follow the line, or a body is in its way.
        """
        key = arm, line, np.asarray(q, dtype=float).tobytes()
        if key not in self._lines:
            self._lines[key] = self._found(self._mover.problem.cell.arms[arm], arm, q, line)
        found = self._lines[key]
        if isinstance(found, str):
            raise InvalidInstanceError(f"{where}: {found}")
        return found

    def _found(self, of: Arm, arm: int, q: Float[np.ndarray, "dof"], line: Line) -> Float[np.ndarray, "k dof"] | str:
        """Returns the path along a line, or why there is none."""
        try:
            path = along_line(of, q, np.array(line.by), LINE_PATH_TOLERANCE).q
        except InvalidInstanceError as error:
            return str(error)
        free = self._mover.edges_free(arm, path)
        if free.all():
            return path
        at = int(np.flatnonzero(~free)[0]) + 1
        words = self._mover.blocked_by(arm, path[at])
        return f"the line of arm '{of.name}' is not free: after {at / (len(path) - 1):.0%} of it, {words}"

    def clear_of(
        self, arm: int, ends: Float[np.ndarray, "n dof"], steps: Sequence[Step], others: Sequence[core.Motion]
    ) -> Float[np.ndarray, "m dof"]:
        """Returns the ends of a move from which the lines after it are clear of other arms."""
        lines = lines_after(steps)
        if not lines:
            return ends
        paths = [self.along_lines(arm, q, lines, "") for q in ends]
        clear = [not self._mover.in_the_way(arm, path, others) for path in paths]
        return ends[np.array(clear, dtype=bool)]


def lines_after(steps: Sequence[Step]) -> list[Line]:
    """Returns the lines after the first of some steps, up to the next move."""
    out = []
    for step in steps[1:]:
        if isinstance(step, Move):
            break
        if isinstance(step, Line):
            out.append(step)
    return out
