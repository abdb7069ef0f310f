"""The proof that comes with a plan: a clearance that all bodies keep at every instant, in double precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env import core
from mmp_env.model.collision import REQUIRED_MARGIN_FACTOR
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.plan import Plan

SHARE = 0.5
"""How much of what the sampled clearance has beyond the required one a certificate may leave unproved: the closer it is
to prove what was sampled, the longer it takes.
"""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Whether the clearances `proved` [m] are proved of a plan; if not, which arms (second -1: one alone) break them,
    and when.

    `instant` counts segments of the plan, with the fraction of the last one.
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
    """The certificate of a plan; it is not valid either where the clock ends the proof."""
    required = plan.problem.levels(REQUIRED_MARGIN_FACTOR, REQUIRED_MARGIN_FACTOR)
    q = [np.ascontiguousarray(plan.positions[name]) for name in plan.problem.cell.arm_names]
    proof = core.certify(plan.problem.cell.collision.core, q, required, share, clock)
    proved = Margins(
        arms=proof.clearance, obstacles=proof.clearance + required.obstacles, self=proof.clearance + required.own
    )
    arms, instant = (proof.arm_a, proof.arm_b), proof.segment + proof.fraction
    return Certificate(valid=proof.valid, proved=proved, arms=arms, instant=instant)
