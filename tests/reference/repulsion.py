"""The repulsive force field of ModifyMotion (APF-ECBS): forces on the waypoints of one arm's path."""

import numpy as np

from mmp_env.model.cell import Cell
from reference.clearance import cloud
from reference.kinematics import link_frames, point_jacobian
from reference.motion import padded

FLOOR_M = 0.01


def sphere_force(p, r_p, others, k_rep, d0, distance, floor):
    """Returns the force [3] of a cloud on a sphere at p: k_rep (1/d - 1/d0) / d^2 per sphere, 0 beyond d0."""
    away = p - others.centers
    between = np.linalg.norm(away, axis=1)
    d = between if distance == "centre" else between - r_p - others.radii
    d = np.maximum(d, floor)
    size = np.where(d <= d0, k_rep * (1 / d - 1 / d0) / d**2, 0)
    return ((size / between)[:, None] * away).sum(axis=0)


def sphere_potential(p, r_p, others, k_rep, d0, distance):
    """Returns the potential of a cloud at a sphere at p: k_rep / 2 (1/d - 1/d0)^2 per sphere, 0 beyond d0."""
    between = np.linalg.norm(p - others.centers, axis=1)
    d = between if distance == "centre" else between - r_p - others.radii
    assert (d > FLOOR_M).all()
    return np.where(d <= d0, k_rep / 2 * (1 / d - 1 / d0) ** 2, 0).sum()


def state_potential(cell: Cell, arm_name, q, others, *, k_rep=0.05, d0=0.10, distance="surface"):
    """Returns the potential of the others, arm name -> [dof], for the moving spheres of an arm at q."""
    own = cloud(cell, cell.arm(arm_name), q)
    return sum(
        sphere_potential(p, r_p, cloud(cell, cell.arm(name), other_q), k_rep, d0, distance)
        for name, other_q in others.items()
        for part, p, r_p in zip(own.parts, own.centers, own.radii, strict=True)
        if part > 0
    )


def state_force(cell: Cell, arm_name, q, others, *, k_rep=0.05, d0=0.10, distance="surface", floor=FLOOR_M):
    """Returns the joint-space force [dof] on an arm at q by the others, arm name -> [dof]."""
    arm = cell.arm(arm_name)
    own = cloud(cell, arm, q)
    frames = link_frames(arm, q)
    force = np.zeros(arm.dof)
    for other_name, other_q in others.items():
        other = cloud(cell, cell.arm(other_name), other_q)
        for part, p, r_p in zip(own.parts, own.centers, own.radii, strict=True):
            push = sphere_force(p, r_p, other, k_rep, d0, distance, floor)
            if part > 0 and push.any():
                local = np.linalg.solve(frames[part], [*p, 1.0])[:3]
                force += point_jacobian(arm, q, part, local).T @ push
    return force


def path_forces(cell: Cell, arm_name, paths, **options):
    """Returns the forces [k, dof] on the waypoints of `paths[arm_name]`, 0 at its ends. Arms stay at their goals."""
    path = np.asarray(paths[arm_name])
    horizon = max(len(p) for p in paths.values()) - 1
    other_paths = {name: padded(np.asarray(p), horizon) for name, p in paths.items() if name != arm_name}
    forces = np.zeros(path.shape)
    for k in range(1, len(path) - 1):
        others = {name: p[k] for name, p in other_paths.items()}
        forces[k] = state_force(cell, arm_name, path[k], others, **options)
    return forces
