"""The proof that comes with a plan: a clearance that all bodies keep at every instant, in double precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env import _core
from mmp_env.collision import REQUIRED_PROOF
from mmp_env.plan import Plan

SHARE = 0.5
"""How much of what the sampled clearance has beyond the required one a certificate may leave unproved: the closer it is
to prove what was sampled, the longer it takes.
"""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Whether `clearance` [m] is proved of a plan; if not, which arms (second -1: one alone) break it, and when.

    `instant` counts segments of the plan, with the fraction of the last one.
    """

    valid: bool
    clearance: float
    arms: tuple[int, int]
    instant: float


def certify(plan: Plan, clock: _core.Clock, *, share: float = SHARE) -> Certificate:
    """The certificate of a plan; it is not valid either where the clock ends the proof."""
    required = REQUIRED_PROOF * plan.problem.margin
    q = [np.ascontiguousarray(plan.positions[name]) for name in plan.problem.cell.arm_names]
    core = plan.problem.cell.collision.core
    valid, clearance, a, b, segment, fraction = _core.certify(core, q, required, share, clock)
    return Certificate(valid=valid, clearance=clearance, arms=(a, b), instant=segment + fraction)
