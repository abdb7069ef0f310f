"""The single-arm planner as the conflict tree calls it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import _core


@dataclass(frozen=True, kw_only=True)
class SiRrtStar:
    """SI-RRT* (Sim, Kim, Nam 2024, arXiv 2404.01752): vertices are (configuration, safe interval), arrival is earliest.

    `eta` [rad] is the steering distance, `iterations` the cap without a solution, `shortcuts` the attempts to shorten
    the path found. See `native/single_arm/si_rrt.hpp` for what we add.
    """

    eta: float = 0.8
    iterations: int = 2000
    shortcuts: int = 40

    def __call__(
        self,
        arm: _core.SingleArm,
        constraints: Sequence[_core.Constraint],
        seed: int,
        budget: float,
        clock: _core.Clock,
        *,
        others: Sequence[_core.Motion] = (),
        experience: Float[np.ndarray, "known dof"] | None = None,
    ) -> tuple[Float[np.ndarray, "k dof"] | None, int]:
        """Configurations on the grid, or None, and the iterations used.

        `others` are motions of other arms that are kept clear of; `experience` is an earlier path on the grid, of which
        the search takes what still holds.
        """
        return arm.plan(
            constraints,
            seed,
            clock,
            max_iterations=int(self.iterations * budget),
            shortcuts=self.shortcuts,
            others=others,
            experience=None if experience is None else np.ascontiguousarray(experience, dtype=float),
        )
