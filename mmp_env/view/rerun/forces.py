"""The forces of the repulsive field on the spheres of one arm, as `native/repulsion/repulsion.hpp` has them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.events import ForceField
from mmp_env.model.cell import Cell

FLOOR_M = 0.01
"""Nearer than this the force grows no more."""


def sphere_forces(
    cell: Cell,
    arm: str,
    q: Float[np.ndarray, "n dof"],
    others: Mapping[str, Float[np.ndarray, "_"]],
    field: ForceField,
) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "n s 3"]]:
    """Sphere centres [m] of an arm at `q`, and the force on each by `others`, arm -> [dof]; none on its base."""
    centers, radii = cell.collision.spheres(arm, q)
    forces = np.zeros_like(centers)
    for name, other in others.items():
        theirs, their_radii = cell.collision.spheres(name, other[None])
        reach = field.d0 if field.centres else field.d0 + radii.max() + their_radii.max()
        low, high = centers.min(axis=(0, 1)) - reach, centers.max(axis=(0, 1)) + reach
        near = ((theirs[0] >= low) & (theirs[0] <= high)).all(axis=1)  # the rest is too far away to push
        away = centers[:, :, None] - theirs[0][near]
        between = np.maximum(np.sqrt(np.einsum("nsoi,nsoi->nso", away, away)), 1e-6)
        d = between if field.centres else between - radii[:, None] - their_radii[near]
        floored = np.maximum(d, FLOOR_M)
        size = np.where(d <= field.d0, np.maximum(field.k_rep * (1 / floored - 1 / field.d0) / floored**2, 0), 0)
        forces += np.einsum("nso,nsoi->nsi", size / between, away)
    forces[:, cell.collision.is_base(arm)] = 0
    return centers, forces
