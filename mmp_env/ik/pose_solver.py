"""All configurations of a chain for a tool pose, but for whole turns: closed form or numeric, then refined."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import SerialChain
from mmp_env.ik.closed_form import ClosedForm, find_closed_forms
from mmp_env.ik.freedom import Free, sampled_poses
from mmp_env.ik.numeric import NumericSolver
from mmp_env.ik.refinement import refined
from mmp_env.ik.self_motion import on_curves
from mmp_env.ik.tool_task import ToolTask
from mmp_env.ik.turns import JointBox, distinct

_SAME = 1e-4
"""Largest difference of a joint [rad or m] between two results that are one configuration."""
_SAMPLES = {0: 1, 1: 32}
"""Number of samples of the redundancy, by its dimension; one joint or one angle has these many values."""
_FORMS = 2
"""Number of locked joints whose grids are tried where one joint is redundant."""
_MORE_SAMPLES = 256
"""Number of samples of a redundancy of two dimensions or more."""
STEP_RAD = 0.1
"""Distance of neighbours on a curve of self-motion [rad], over all joints together."""
_FREE_STEP_RAD = 0.2
"""The same where the rotation about the z axis of the tool is free, and the curves are longer."""
_NEAR, _STEPS = 0.1, 12
"""Largest error [rad, or arm lengths] of results of a closed form, and most steps of their refinement."""
_LIMIT_SLACK = 0.02
"""Distance [rad or m] outside of the limits up to which results of a closed form are refined."""


class PoseSolver:
    """Finds configurations of one chain.

    Args:
        chain: the arm.
        box: its joint limits.
    """

    def __init__(self, chain: SerialChain, box: JointBox) -> None:
        self.box = box
        self._chain = chain
        self._forms = find_closed_forms(chain, box)

    def solve(self, pose: Float[np.ndarray, "4 4"], free: Free | None) -> Float[np.ndarray, "n dof"]:
        """Returns configurations within the joint limits, each with the least turns that are."""
        if np.linalg.norm(pose[:3, 3] - self._chain.offsets[0]) > self._reach:
            return np.zeros((0, self._chain.dof))
        task = ToolTask(chain=self._chain, free=free)
        curves = self._chain.dof == task.rows + 1
        slack = np.inf if curves else _LIMIT_SLACK
        # A short closed curve may lie between two values of one locked joint, but rarely of another one as well.
        forms = self._forms[: _FORMS if curves else 1]
        solutions = [self._solve_in_closed_form(form, pose, free, slack) for form in forms]
        q = np.concatenate(solutions) if forms else self._numeric.solve(pose, free)
        if curves:
            q = on_curves(task, self.box, distinct(q, _SAME), pose, step=STEP_RAD if free is None else _FREE_STEP_RAD)
        return distinct(self.box.within(q), _SAME)

    @cached_property
    def _reach(self) -> float:
        """Upper bound of the distance of the tool frame from the first joint [m], with room for rounding."""
        slides = self._chain.slides
        travel = np.maximum(np.abs(self.box.lower), np.abs(self.box.upper))[slides].sum()
        return self._chain.length + float(travel) + 1e-6

    @cached_property
    def _numeric(self) -> NumericSolver:
        return NumericSolver(self._chain, *self.box.one_turn())

    def _solve_in_closed_form(
        self, form: ClosedForm, pose: Float[np.ndarray, "4 4"], free: Free | None, slack: float
    ) -> Float[np.ndarray, "n dof"]:
        locked, rotations = len(form.locked), {None: 0, "z": 1, "rotation": 3}[free]
        samples = _SAMPLES.get(locked + rotations, _MORE_SAMPLES)
        poses = round(samples ** (rotations / max(locked + rotations, 1)))
        steps = round((samples / poses) ** (1 / max(locked, 1)))
        targets = sampled_poses(pose, free, poses)
        q, owner = form.solve(targets, steps)
        usable = self.box.inside(q, slack) if np.isfinite(slack) else np.ones(len(q), dtype=bool)
        task = ToolTask(chain=self._chain, free=None)
        return refined(task, q[usable], targets[owner[usable]], steps=_STEPS, farthest=_NEAR)[0]
