"""Times paths within velocity, acceleration and jerk limits, from rest to rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError, UnprovedPlanError
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.retime import retime
from mmp_env.retime.limits import JointLimits
from mmp_planners.work.handling import Handling

TOLERANCE_RAD = 0.05
"""Largest distance of a joint from a path at its rounded corners [rad, of slides m]."""
LONGEST_MOTION_S = 80.0
"""Longest motion of one step of a job [s]."""


class Timing:
    """Samples of motions along paths.

    Args:
        handling: the objects, and cell and velocity limits.
        period_s: time between two samples [s].
        max_acceleration: [rad/s^2], as in `mmp_env.retime.retime`.
        max_jerk: [rad/s^3], likewise.
    """

    def __init__(
        self, handling: Handling, period_s: float, max_acceleration: JointLimits = None, max_jerk: JointLimits = None
    ) -> None:
        self._handling, self.period_s = handling, period_s
        self._max_acceleration, self._max_jerk = max_acceleration, max_jerk
        self._alone = {name: _alone(handling.bare, name) for name in handling.bare.cell.arm_names}
        self._known: dict[tuple[str, float, bytes], Float[np.ndarray, "n _dof"]] = {}

    def unproved(
        self, name: str, path: Float[np.ndarray, "k dof"], tolerance: float = TOLERANCE_RAD
    ) -> Float[np.ndarray, "n dof"] | None:
        """Returns the samples of a motion of one arm along a path, as if nothing else were in the cell.

        The samples of a path backwards are those of the path in reverse order: all limits are symmetric.

        Args:
            name: the arm.
            path: configurations, straight in between [rad, of slides m].
            tolerance: largest distance of a joint from the path [rad, of slides m].

        Returns:
            The samples, not tested against obstacles and other arms; None if the rounded path touches the arm itself.

        Raises:
            MmpError: for limits that are too low for the length of the motion.
        """
        key = name, tolerance, np.ascontiguousarray(path).tobytes()
        if key not in self._known:
            found = self._retimed(self._alone[name], np.arange(len(path), dtype=float), {name: path}, tolerance)
            if found is None:
                return None
            self._known[key] = found[name]
            self._known[name, tolerance, np.ascontiguousarray(path[::-1]).tobytes()] = found[name][::-1]
        return self._known[key]

    def of_arm(
        self,
        name: str,
        path: Float[np.ndarray, "k dof"],
        rests: Mapping[str, Float[np.ndarray, "_dof"]],
        tolerance: float = TOLERANCE_RAD,
    ) -> Float[np.ndarray, "n dof"] | None:
        """Returns the samples of a motion of one arm along a path; None if its rounded path cannot be proved.

        Args:
            name: the arm.
            path: configurations, straight in between [rad, of slides m].
            rests: arm name -> where each arm stands [dof].
            tolerance: largest distance of a joint from the path [rad, of slides m].

        Raises:
            MmpError: for limits that are too low for the length of the motion.
        """
        rows = {other: path if other == name else np.repeat(q[None], len(path), axis=0) for other, q in rests.items()}
        samples = self.together(np.arange(len(path), dtype=float), rows, tolerance)
        return None if samples is None else samples[name]

    def together(
        self,
        times: Float[np.ndarray, "t"],
        paths: Mapping[str, Float[np.ndarray, "t _dof"]],
        tolerance: float = TOLERANCE_RAD,
    ) -> dict[str, Float[np.ndarray, "n _dof"]] | None:
        """Returns the samples of a motion of all arms on one clock; None if it cannot be proved.

        Raises:
            MmpError: for limits that are too low for the length of the motion.
        """
        return self._retimed(self._handling.problem, times, paths, tolerance)

    def _retimed(
        self,
        problem: Problem,
        times: Float[np.ndarray, "t"],
        paths: Mapping[str, Float[np.ndarray, "t _dof"]],
        tolerance: float,
    ) -> dict[str, Float[np.ndarray, "n _dof"]] | None:
        ends = replace(
            problem,
            start={name: rows[0] for name, rows in paths.items()},
            goal={name: rows[-1] for name, rows in paths.items()},
            goals={},
            goal_asked={},
        )
        plan = Plan(problem=ends, times=times, positions=paths)
        try:
            motion = retime(
                plan,
                rate=1.0 / self.period_s,
                tolerance=tolerance,
                max_acceleration=_of(paths, self._max_acceleration),
                max_jerk=_of(paths, self._max_jerk),
            )
        except UnprovedPlanError:
            return None
        if motion.makespan_s > LONGEST_MOTION_S:
            raise MmpError(
                f"a motion would take {motion.makespan_s:.3g} s, and one step of a job takes {LONGEST_MOTION_S:g} s at"
                " most; the limits of the joints are too low for it"
            )
        # At rest for a period at both ends, the curve through the samples begins and ends at rest.
        return {name: np.pad(rows, ((1, 1), (0, 0)), mode="edge") for name, rows in motion.positions.items()}


def _alone(problem: Problem, name: str) -> Problem:
    """Returns a problem of one arm in a cell without anything else."""
    cell = problem.cell
    keep = {name: cell.keep[name]} if name in cell.keep else {}
    alone = replace(cell, arms=(cell.arm(name),), obstacles=(), joints=None, keep=keep)
    start, velocity = ({name: each[name]} for each in (problem.start, problem.max_velocity))
    return replace(problem, cell=alone, start=start, goal=start, max_velocity=velocity, goals={}, goal_asked={})


def _of(names: Iterable[str], limits: JointLimits) -> JointLimits:
    """Returns the limits of some arms."""
    return {name: limits[name] for name in names} if isinstance(limits, Mapping) else limits
