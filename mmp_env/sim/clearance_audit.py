"""How close MuJoCo's bodies came to each other in an execution, against what is proved of its plan.

The proof is about spheres around the bodies where the plan has them; a body lies inside its spheres but for `OUTSIDE_M`
(docs/reference/robots.md). So bodies are measured only where the spheres of the executed configurations are close.
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
from mmp_env.sim.simulation import Simulation

OUTSIDE_M = 0.001
"""A body sticks out of its spheres by no more."""
_PROOF_SHARE, _PROOF_S = 0.05, 5.0
"""The proof may leave this share of the sampled clearance unproved, which is closer than planners ask for; and takes no
longer. A plan that is not proved by then counts as one without a proof.
"""
_SAME_RAD = 1e-9
"""Rows whose joints differ by no more are looked at once."""


@dataclass(frozen=True, kw_only=True)
class Nearness:
    """`planned_m` [m]: the clearance that is proved of the plan, None where none is.

    `closer_m`: by how much two bodies of different arms, or of an arm and an obstacle, came closer than is proved of
    their kind; 0 where none did. `body_a`, `body_b` and `time_s` [s] say which and when.
    """

    planned_m: float | None
    closer_m: float = 0.0
    body_a: str = ""
    body_b: str = ""
    time_s: float | None = None


def nearness(
    simulation: Simulation,
    plan: Plan,
    times: Float[np.ndarray, "t"],
    positions: Mapping[str, Float[np.ndarray, "t dof"]],
) -> Nearness:
    """What was recorded of an execution of `plan` against its proof; arms that do not move count as they stood."""
    count = len(plan.times)
    whole = {
        name: plan.positions[name] if name in plan.positions else np.tile(positions[name][0], (count, 1))
        for name in plan.problem.cell.arm_names
    }
    certificate = certify(dataclasses.replace(plan, positions=whole), core.Clock(_PROOF_S), share=_PROOF_SHARE)
    if not certificate.valid:
        return Nearness(planned_m=None)
    proved = certificate.proved
    planned, most = min(proved.arms, proved.obstacles), max(proved.arms, proved.obstacles)
    clear = simulation.cell.collision.clearance(positions)
    close = np.flatnonzero(clear < most + OUTSIDE_M)
    q = np.concatenate([positions[name] for name in simulation.slices], axis=1)[close]
    if len(q):  # standing still needs one look
        moved = np.append(True, np.abs(np.diff(q, axis=0)).max(axis=1) > _SAME_RAD)
        close, q = close[moved], q[moved]
    closer, bodies, at = 0.0, ("", ""), None
    for row, distance, pair in _measured(simulation, q, most):
        kept = proved.obstacles if pair[1].startswith("obstacle/") else proved.arms
        if kept - distance > closer:
            closer, bodies, at = kept - distance, pair, float(times[close[row]])
    return Nearness(planned_m=planned, closer_m=closer, body_a=bodies[0], body_b=bodies[1], time_s=at)


def _measured(
    simulation: Simulation, q: Float[np.ndarray, "m n"], within: float
) -> Iterator[tuple[int, float, tuple[str, str]]]:
    """(row, distance [m], names) of bodies closer than `within` [m] at rows of `q`, as MuJoCo's collisions have it."""
    model = copy.copy(simulation.model)
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
