"""The single-arm planner SI-RRT*, the low level of the multi-arm planners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core


@dataclass(frozen=True, kw_only=True)
class SiRrtStar:
    """SI-RRT*: vertices are (configuration, safe interval) with the earliest arrival (Sim, Kim, Nam: Safe interval
    RRT* for scalable multi-robot path planning in continuous space, arXiv 2404.01752, 2024).

    `eta` [rad] is the steering distance, `iterations` the limit without a solution, `shortcuts` the number of attempts
    to shorten the path. `improve` is the number of iterations after the first path. `direct` says whether straight
    lines and the branch of the static tree are tried first, and `static_tree` whether that tree is used at all. See
    `native/single_arm/si_rrt.hpp` for what we add.
    """

    eta: float = core.STEERING_RAD
    iterations: int = core.SingleArmSettings().max_iterations
    shortcuts: int = core.SingleArmSettings().shortcuts
    improve: int = core.SingleArmSettings().improve_iterations
    direct: bool = core.SingleArmSettings().direct
    static_tree: bool = core.SingleArmSettings().static_tree

    def __call__(
        self,
        arm: core.SingleArm,
        constraints: Sequence[core.Constraint],
        seed: int,
        budget: float,
        clock: core.Clock,
        *,
        others: Sequence[core.Motion] = (),
        experience: Float[np.ndarray, "known dof"] | None = None,
    ) -> tuple[Float[np.ndarray, "k dof"] | None, int]:
        """Plans one arm from its start to its goal.

        Args:
            arm: the arm's single-arm planner.
            constraints: constraints that the path satisfies.
            seed: seed of the samples.
            budget: factor of `iterations`.
            clock: deadline of the call.
            others: motions of other arms that the path keeps clear of.
            experience: an earlier path [known, dof] [rad] on the grid; the search begins with what is still valid.

        Returns:
            The configurations [k, dof] [rad] on the grid, or None, and the number of iterations.
        """
        return arm.plan(
            constraints,
            seed,
            clock,
            settings=core.SingleArmSettings(
                max_iterations=int(self.iterations * budget),
                improve_iterations=self.improve,
                shortcuts=self.shortcuts,
                direct=self.direct,
                static_tree=self.static_tree,
            ),
            others=others,
            experience=None if experience is None else np.ascontiguousarray(experience, dtype=float),
        )
