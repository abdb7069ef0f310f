"""A repulsive modification worked out: spheres, forces and clearances, iterate by iterate.

All of it is of one instant, that at which the arm, before it was modified, came nearest to another one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.problem import Problem
from mmp_env.view.rerun.clouds import cloud, contacts_alone, sphere_gaps
from mmp_env.view.rerun.forces import sphere_forces
from mmp_env.view.rerun.meetings import configurations
from mmp_env.view.rerun.record import Push


@dataclass(frozen=True, kw_only=True, eq=False)
class Steps:
    """A row for the path as it was, and one for each iterate. `instant` is the step of the path that is shown."""

    push: Push
    instant: int
    paths: Float[np.ndarray, "n k dof"]
    others: Mapping[str, Float[np.ndarray, "_"]]
    """Where the other arms are at the instant: arm -> [dof]."""
    pushing: frozenset[str]
    """The other arms that push at the instant, in any iterate."""
    centers: Float[np.ndarray, "n s 3"]
    forces: Float[np.ndarray, "n s 3"]
    touching: Bool[np.ndarray, "n s"]
    nearest: Float[np.ndarray, "n"]
    """Least clearance of the whole path from the other arms [m]."""

    @property
    def arm(self) -> str:
        return self.push.repelled.arm


def work_out(problem: Problem, push: Push) -> Steps:
    """A modification in full. Where no iterates were told there are the paths before and after."""
    cell, repelled = problem.cell, push.repelled
    arm = repelled.arm
    paths = np.array([repelled.before, *(repelled.iterates or (repelled.after,))])
    grid = np.arange(paths.shape[1], dtype=float)
    others = {name: configurations(q, grid) for name, q in push.told.paths.items() if name != arm}
    gaps = _clearances(problem, arm, paths, others)
    nearest = np.min([np.full(paths.shape[:2], np.inf), *gaps.values()], axis=0)
    instant = 1 + int(np.argmin(nearest[0, 1:-1])) if len(grid) > 2 else 0
    here = {name: q[instant] for name, q in others.items()}
    rows = paths[:, instant]
    centers, _ = cell.collision.spheres(arm, rows)
    forces, pushing = np.zeros_like(centers), set()
    touching = contacts_alone(cell, arm, rows, problem.conflict_distances)
    for name, q in here.items():
        least = gaps[name][:, instant].min()
        if repelled.field is not None and least <= repelled.field.d0:
            force = sphere_forces(cell, arm, rows, {name: q}, repelled.field)[1]
            forces += force
            pushing |= {name} if force.any() else set()
        if least < problem.conflict_distances.arms:
            still = np.tile(q, (len(rows), 1))
            hits = sphere_gaps(cloud(cell, arm, rows), cloud(cell, name, still)) < problem.conflict_distances.arms
            touching |= np.any(hits, axis=2)
    return Steps(
        push=push,
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
    """Distance of an arm from each other one [m] at each step of each path."""
    model, count = problem.cell.collision, len(paths)
    rows = paths.reshape(-1, paths.shape[2])
    return {
        name: model.pair_clearance(arm, rows, name, np.tile(q, (count, 1))).reshape(paths.shape[:2])
        for name, q in others.items()
    }
