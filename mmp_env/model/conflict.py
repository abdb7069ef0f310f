"""Conflicts: two arms of a plan that come closer than the margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.brief import brief
from mmp_env.wording import in_seconds

_RESAMPLED_RAD = 0.02
"""Largest move [rad] of a joint between the instants that resolve a conflict."""
_ROUNDING_M = 1e-5
"""Accuracy [m] of the single-precision kernels within 40 m of the origin."""


@runtime_checkable
class TimedPlan(Protocol):
    """The part of a `Plan` that a search for conflicts uses."""

    @property
    def problem(self) -> Any: ...
    def check_complete(self) -> None: ...
    def finer_times(self, step_rad: float) -> Float[np.ndarray, "n"]: ...
    def sampled(self, times: Float[np.ndarray, "n"]) -> Mapping[str, Float[np.ndarray, "n dof"]]: ...


@runtime_checkable
class MotionQueries(Protocol):
    """The part of a `CollisionModel` that a search for conflicts uses."""

    def motion(self, arm: str, q: Float[np.ndarray, "k dof"]) -> core.Motion: ...
    def conflict_instants(
        self, motions: Sequence[core.Motion], pairs: ArrayLike, levels: core.Levels, *, bases: bool = False
    ) -> list[Float[np.ndarray, "c"]]: ...
    def pair_clearance(
        self, arm_a: str, q_a: ArrayLike, arm_b: str, q_b: ArrayLike, *, precise: bool = False
    ) -> Float[np.ndarray, "n"]: ...
    def spheres(self, arm: str, q: ArrayLike) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "s"]]: ...
    def is_base(self, arm: str) -> Bool[np.ndarray, "s"]: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Conflict:
    """Two arms that come closer than the margin.

    Attributes:
        arm_a: name of one arm.
        arm_b: name of the other arm.
        time_s: first instant [s], the same as `start_s`.
        start_s: start of the conflict interval [s].
        end_s: end of the conflict interval [s].
        q_a: configuration [rad] of `arm_a` at the instant of least clearance.
        q_b: configuration [rad] of `arm_b` at that instant.
        spheres: the nearest pair of spheres then, indices as in `CollisionModel.spheres`.
        depth_m: penetration of that pair [m], negative if the surfaces do not touch.
    """

    arm_a: str
    arm_b: str
    time_s: float
    start_s: float
    end_s: float
    q_a: Float[np.ndarray, "dof_a"]
    q_b: Float[np.ndarray, "dof_b"]
    spheres: tuple[int, int]
    depth_m: float

    @brief
    def __repr__(self) -> str:
        how = f"{abs(self.depth_m) * 1e3:.1f} mm {'deep' if self.depth_m >= 0 else 'apart'}"
        return f"of {self.arm_a} and {self.arm_b} from {self.start_s:.2f} to {in_seconds(self.end_s)}, {how}"


def plan_conflicts(model: MotionQueries, plan: TimedPlan) -> list[Conflict]:
    """Returns all conflicts of a plan, earliest first, one for each pair of arms and unbroken interval.

    Intervals are resolved to instants between which no joint moves more than 0.02 rad. No conflict between two instants
    is missed, because `conflict_instants` proves the motion between them. Raises `MmpError` for a plan without an arm.
    """
    plan.check_complete()
    times = plan.finer_times(_RESAMPLED_RAD)
    names, q = plan.problem.cell.arm_names, plan.sampled(times)
    motions = [model.motion(a, q[a]) for a in names]
    pairs = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
    out = []
    margin = plan.problem.margin
    closer = max(margin - _ROUNDING_M, margin / 2)  # a plan that keeps its margin exactly has no conflict
    found = model.conflict_instants(motions, pairs, core.Levels(closer, 0.9 * closer), bases=True)
    for (i, j), instants in zip(pairs, found, strict=True):
        for run in unbroken_runs(instants):
            out.append(_conflict(model, names[i], names[j], q, times, np.rint(run).astype(int)))
    return sorted(out, key=lambda c: (c.time_s, c.arm_a, c.arm_b))


def unbroken_runs(instants: Float[np.ndarray, "c"]) -> list[Float[np.ndarray, "_"]]:
    """Returns the instants of conflict of two arms [steps], split at gaps of more than one step."""
    return np.split(instants, np.flatnonzero(np.diff(instants) > 1) + 1) if len(instants) else []


def _conflict(
    model: MotionQueries, a: str, b: str, q: Mapping[str, np.ndarray], times: np.ndarray, run: np.ndarray
) -> Conflict:
    k = int(run[np.argmin(model.pair_clearance(a, q[a][run], b, q[b][run]))])
    (centers_a, radii_a), (centers_b, radii_b) = (model.spheres(x, q[x][k : k + 1]) for x in (a, b))
    gaps = np.linalg.norm(centers_a[0][:, None] - centers_b[0][None], axis=2) - radii_a[:, None] - radii_b[None]
    gaps[np.logical_and.outer(model.is_base(a), model.is_base(b))] = np.inf
    pair = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
    return Conflict(
        arm_a=a,
        arm_b=b,
        time_s=float(times[run[0]]),
        start_s=float(times[run[0]]),
        end_s=float(times[run[-1]]),
        q_a=q[a][k],
        q_b=q[b][k],
        spheres=(int(pair[0]), int(pair[1])),
        depth_m=float(-gaps[pair]),
    )
