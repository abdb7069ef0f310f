"""The certificate of a plan: clearances that all bodies keep at every instant, proved in double precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env import core
from mmp_env.model.collision import REQUIRED_MARGIN_FACTOR
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.plan import Plan

SHARE = 0.5
"""Share of the sampled clearance beyond the required one that a certificate may leave unproved. A smaller share takes
longer to prove.
"""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """The result of a proof.

    Attributes:
        valid: whether the proof ended with at least the margins of the problem.
        proved: clearances [m] proved, if valid.
        arms: indices of the arms that break the proof; the second is -1 for one arm alone.
        instant: where they do: segments of the plan, with the fraction of the last one.
    """

    valid: bool
    proved: Margins
    arms: tuple[int, int]
    instant: float

    @property
    def clearance(self) -> float:
        """The least of the proved clearances [m]."""
        return min(self.proved[kind] for kind in KINDS)


def certify(plan: Plan, clock: core.Clock, *, share: float = SHARE) -> Certificate:
    """Proves the clearances of a plan. Returns a certificate that is not valid if the clock ends the proof."""
    required = plan.problem.levels(REQUIRED_MARGIN_FACTOR, REQUIRED_MARGIN_FACTOR)
    q = [np.ascontiguousarray(plan.positions[name]) for name in plan.problem.cell.arm_names]
    proof = core.certify(plan.problem.cell.collision.core, q, required, share, clock)
    proved = Margins(
        arms=proof.clearance, obstacles=proof.clearance + required.obstacles, self=proof.clearance + required.own
    )
    arms, instant = (proof.arm_a, proof.arm_b), proof.segment + proof.fraction
    return Certificate(valid=proof.valid, proved=proved, arms=arms, instant=instant)
