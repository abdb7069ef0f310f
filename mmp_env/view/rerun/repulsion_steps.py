"""Spheres, forces and clearances of a repulsive modification, iterate by iterate.

They are computed at the time at which the unmodified path of the arm is closest to another arm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.events import ForceField
from mmp_env.model.cell import Cell
from mmp_env.model.problem import Problem
from mmp_env.view.rerun.conflict_intervals import configurations_at
from mmp_env.view.rerun.search_record import RecordedRepulsion
from mmp_env.view.rerun.sphere_clouds import sphere_cloud, sphere_gaps, touching_obstacles_or_self

FLOOR_M = 0.01
"""Distance [m] below which the force grows no more."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RepulsionSteps:
    """A row for the path before the modification and one per iterate; `instant` is the step that is shown."""

    repulsion: RecordedRepulsion
    instant: int
    paths: Float[np.ndarray, "n k dof"]
    others: Mapping[str, Float[np.ndarray, "_"]]
    """Configurations of the other arms at the instant: arm -> [dof] [rad]."""
    pushing: frozenset[str]
    """Other arms that exert a force at the instant, in any iterate."""
    centers: Float[np.ndarray, "n s 3"]
    forces: Float[np.ndarray, "n s 3"]
    touching: Bool[np.ndarray, "n s"]
    nearest: Float[np.ndarray, "n"]
    """Least clearance of the whole path from the other arms [m]."""

    @property
    def arm(self) -> str:
        return self.repulsion.repelled.arm


def repulsion_steps(problem: Problem, repulsion: RecordedRepulsion) -> RepulsionSteps:
    """Computes a modification. If the planner reports no iterates, only the paths before and after are shown."""
    cell, repelled = problem.cell, repulsion.repelled
    arm = repelled.arm
    paths = np.array([repelled.before, *(repelled.iterates or (repelled.after,))])
    grid = np.arange(paths.shape[1], dtype=float)
    others = {name: configurations_at(q, grid) for name, q in repulsion.created.paths.items() if name != arm}
    gaps = _clearances(problem, arm, paths, others)
    nearest = np.min([np.full(paths.shape[:2], np.inf), *gaps.values()], axis=0)
    instant = 1 + int(np.argmin(nearest[0, 1:-1])) if len(grid) > 2 else 0
    here = {name: q[instant] for name, q in others.items()}
    rows = paths[:, instant]
    centers, _ = cell.collision.spheres(arm, rows)
    forces, pushing = np.zeros_like(centers), set()
    touching = touching_obstacles_or_self(cell, arm, rows, problem.conflict_distances)
    for name, q in here.items():
        least = gaps[name][:, instant].min()
        if repelled.field is not None and least <= repelled.field.d0:
            force = sphere_forces(cell, arm, rows, {name: q}, repelled.field)[1]
            forces += force
            pushing |= {name} if force.any() else set()
        if least < problem.conflict_distances.arms:
            still = np.tile(q, (len(rows), 1))
            hits = (
                sphere_gaps(sphere_cloud(cell, arm, rows), sphere_cloud(cell, name, still))
                < problem.conflict_distances.arms
            )
            touching |= np.any(hits, axis=2)
    return RepulsionSteps(
        repulsion=repulsion,
        instant=instant,
        paths=paths,
        others=here,
        pushing=frozenset(pushing),
        centers=centers,
        forces=forces,
        touching=touching,
        nearest=nearest.min(axis=1),
    )


def _clearances(
    problem: Problem, arm: str, paths: Float[np.ndarray, "n k dof"], others: Mapping[str, Float[np.ndarray, "k _"]]
) -> dict[str, Float[np.ndarray, "n k"]]:
    """Returns the distance [m] of an arm from each other arm at each step of each path."""
    model, count = problem.cell.collision, len(paths)
    rows = paths.reshape(-1, paths.shape[2])
    return {
        name: model.pair_clearance(arm, rows, name, np.tile(q, (count, 1))).reshape(paths.shape[:2])
        for name, q in others.items()
    }


def sphere_forces(
    cell: Cell,
    arm: str,
    q: Float[np.ndarray, "n dof"],
    others: Mapping[str, Float[np.ndarray, "_"]],
    field: ForceField,
) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "n s 3"]]:
    """Returns the sphere centres [m] of an arm at `q` and the force of `others`, arm -> [dof], on each; 0 on its base.

    The formula is that of `native/` (see `repulsive_force`) without `exact_within`.
    """
    centers, radii = cell.collision.spheres(arm, q)
    forces = np.zeros_like(centers)
    for name, other in others.items():
        theirs, their_radii = cell.collision.spheres(name, other[None])
        reach = field.d0 if field.centres else field.d0 + radii.max() + their_radii.max()
        low, high = centers.min(axis=(0, 1)) - reach, centers.max(axis=(0, 1)) + reach
        near = ((theirs[0] >= low) & (theirs[0] <= high)).all(axis=1)  # the others are too far away to exert a force
        away = centers[:, :, None] - theirs[0][near]
        between = np.maximum(np.sqrt(np.einsum("nsoi,nsoi->nso", away, away)), 1e-6)
        d = between if field.centres else between - radii[:, None] - their_radii[near]
        floored = np.maximum(d, FLOOR_M)
        size = np.where(d <= field.d0, np.maximum(field.k_rep * (1 / floored - 1 / field.d0) / floored**2, 0), 0)
        forces += np.einsum("nso,nsoi->nsi", size / between, away)
    forces[:, cell.collision.is_base(arm)] = 0
    return centers, forces
