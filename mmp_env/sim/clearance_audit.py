"""Audit of an execution: the distances of MuJoCo's bodies, compared with the clearance that is proved of the plan.

The proof is about covering spheres. A body protrudes from its spheres by `PROTRUSION_M` at most; see
docs/reference/robots.md. So the audit measures bodies only where the spheres of the executed configurations are close.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.certificate import certify
from mmp_env.model.plan import Plan
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.contacts import names_and_owners
from mmp_env.sim.driven import Driven

PROTRUSION_M = 0.001
"""Largest protrusion of a body from its spheres."""
_PROOF_SHARE, _PROOF_S = 0.05, 5.0
"""Share of the sampled clearance that the proof may leave unproved, and time limit of the proof."""
_SAME_RAD = 1e-9
"""Largest motion of a joint between two rows that are measured once."""


@dataclass(frozen=True, kw_only=True)
class ClearanceAudit:
    """The result of an audit.

    `planned_m` [m] is the clearance that is proved of the plan, or None without a proof. `closer_m` [m] is how much
    closer than proved two bodies of different arms, or of an arm and an obstacle, came; 0 if no bodies did. `body_a`,
    `body_b` and `time_s` [s] say which bodies, and when.
    """

    planned_m: float | None
    closer_m: float = 0.0
    body_a: str = ""
    body_b: str = ""
    time_s: float | None = None


def audit_clearance(
    simulation: Driven,
    plan: Plan,
    times: Float[np.ndarray, "t"],
    positions: Mapping[str, Float[np.ndarray, "t dof"]],
) -> ClearanceAudit:
    """Returns the audit of an execution.

    Args:
        simulation: the simulation of the execution.
        plan: the executed plan. Arms without a trajectory keep their first recorded position.
        times: recorded times [t] [s].
        positions: recorded configurations, arm name -> [t, dof] [rad].
    """
    count = len(plan.times)
    whole = {
        name: plan.positions[name] if name in plan.positions else np.tile(positions[name][0], (count, 1))
        for name in plan.problem.cell.arm_names
    }
    certificate = certify(dataclasses.replace(plan, positions=whole), core.Clock(_PROOF_S), share=_PROOF_SHARE)
    if not certificate.valid:
        return ClearanceAudit(planned_m=None)
    proved = certificate.proved
    planned, most = min(proved.arms, proved.obstacles), max(proved.arms, proved.obstacles)
    clear = simulation.cell.collision.clearance(positions)
    close = np.flatnonzero(clear < most + PROTRUSION_M)
    q = np.concatenate([positions[name] for name in simulation.slices], axis=1)[close]
    if len(q):  # rows without motion are measured once
        moved = np.append(True, np.abs(np.diff(q, axis=0)).max(axis=1) > _SAME_RAD)
        close, q = close[moved], q[moved]
    closer, bodies, at = 0.0, ("", ""), None
    for row, distance, pair in _measured(simulation, q, most):
        kept = proved.obstacles if pair[1].startswith("obstacle/") else proved.arms
        if kept - distance > closer:
            closer, bodies, at = kept - distance, pair, float(times[close[row]])
    return ClearanceAudit(planned_m=planned, closer_m=closer, body_a=bodies[0], body_b=bodies[1], time_s=at)


def _measured(
    simulation: Driven, q: Float[np.ndarray, "m n"], within: float
) -> Iterator[tuple[int, float, tuple[str, str]]]:
    """Yields (row, distance [m], names) of bodies closer than `within` [m] in rows of `q`, by MuJoCo's collisions."""
    model = copy.copy(simulation.scene_model)
    model.geom_margin[:] = within
    data = mujoco.MjData(model)
    names, owners = names_and_owners(model, simulation.cell)
    for row, positions in enumerate(q):
        data.qpos[:] = positions
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for (a, b), distance in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
            if owners[a] != owners[b]:
                first, second = (a, b) if owners[a] < owners[b] else (b, a)
                yield row, distance, (names[first], names[second])
