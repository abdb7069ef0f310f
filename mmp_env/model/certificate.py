"""The certificate of a plan: clearances that all bodies keep at every instant, proved in double precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.arm import Obstacle
from mmp_env.model.collision import REQUIRED_MARGIN_FACTOR
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.plan import Plan

SHARE = 0.8
"""Share of the sampled clearance beyond the required one that a certificate may leave unproved. A smaller share takes
longer to prove.
"""


_PART_RAD, _MOST_PARTS = 0.01, 1000
"""Motion of a joint in one part of the proof about obstacles that move; most parts of a step."""
_ROUNDING_M = 1e-6
"""What is taken off their clearances, for rounding [m]."""


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
    found = Certificate(valid=proof.valid, proved=proved, arms=arms, instant=instant)
    moving = [obstacle for obstacle in plan.problem.cell.obstacles if obstacle.speed]
    return _among_moving(plan, moving, found, required.proof + required.obstacles) if moving and found.valid else found


def _among_moving(plan: Plan, moving: Sequence[Obstacle], found: Certificate, required: float) -> Certificate:
    """Returns a certificate of what stands still as one that also holds for obstacles that move."""
    least, arm, at = found.proved.obstacles, 0, 0.0
    for k, name in enumerate(plan.problem.cell.arm_names):
        times, rows, segment = _cut(plan.times, plan.positions[name])
        for obstacle in moving:
            clearance = plan.problem.cell.collision.swept_clearance(name, rows, obstacle)
            clearance -= obstacle.speed * times[1:] + _ROUNDING_M
            clearance[~(np.diff(rows, axis=0) != 0).any(axis=1)] = np.inf  # an arm that stands may be met
            worst = int(np.argmin(clearance))
            if clearance[worst] < least:
                least, arm, at = float(clearance[worst]), k, float(segment[worst])
    if least >= required:
        return replace(found, proved=replace(found.proved, obstacles=least))
    return replace(found, valid=False, arms=(arm, -1), instant=at)


def _cut(
    times: Float[np.ndarray, "t"], q: Float[np.ndarray, "t dof"]
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n dof"], Float[np.ndarray, "n-1"]]:
    """Returns times and configurations of the same motion in short parts, and where in the plan each part begins."""
    if len(times) == 1:
        times, q = np.repeat(times, 2), np.repeat(q, 2, axis=0)
    parts = np.clip(np.ceil(np.abs(np.diff(q, axis=0)).max(axis=1) / _PART_RAD), 1, _MOST_PARTS).astype(int)
    nth = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    place = np.append(np.repeat(np.arange(len(parts)), parts) + nth / np.repeat(parts, parts), len(parts))
    grid = np.arange(len(times))
    rows = np.column_stack([np.interp(place, grid, column) for column in q.T])
    return np.interp(place, grid, times), rows, place[:-1]
