"""Clearances between arms that are clouds of spheres [m]: negative where they overlap."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from reference.distance import to_obstacle
from reference.kinematics import link_frames, part_names


@dataclass(frozen=True)
class Cloud:
    """Spheres in the world: `parts` [s] (0 the base, then the links, the tool last), `centers` [s, 3], `radii` [s]."""

    parts: np.ndarray
    centers: np.ndarray
    radii: np.ndarray

    def only(self, keep):
        return Cloud(self.parts[keep], self.centers[keep], self.radii[keep])

    @property
    def moving(self):
        return self.only(self.parts > 0)

    @property
    def base(self):
        return self.only(self.parts == 0)


def cloud(cell: Cell, arm: Arm, q):
    """Returns all spheres of an arm at q, in the order of the files: links, then tool."""
    frames = link_frames(arm, q)
    own = arm.robot.spheres[cell.spheres]
    parts, local, radii = own.links, own.centers, own.radii
    if arm.tool is not None:
        tool = arm.tool.spheres[cell.spheres]
        parts = np.concatenate([parts, np.full(len(tool.radii), len(frames) - 1)])
        local = np.vstack([local, tool.centers])
        radii = np.concatenate([radii, tool.radii])
    turned = np.einsum("sij,sj->si", frames[parts, :3, :3], local)
    return Cloud(parts=parts, centers=frames[parts, :3, 3] + turned, radii=radii)


def gaps(a: Cloud, b: Cloud):
    """Returns the distance between the surfaces of every sphere of a and every sphere of b, [a, b]."""
    between = np.linalg.norm(a.centers[:, None] - b.centers[None], axis=-1)
    return between - a.radii[:, None] - b.radii[None]


def least_gap(a: Cloud, b: Cloud):
    """Returns the least distance between the surfaces of two clouds."""
    return float(gaps(a, b).min(initial=np.inf))


def moving_clearance(cell: Cell, arm_a, q_a, arm_b, q_b):
    """Returns the clearance between the moving links of two arms."""
    a, b = cloud(cell, cell.arm(arm_a), q_a), cloud(cell, cell.arm(arm_b), q_b)
    return least_gap(a.moving, b.moving)


def clearance_of_motions(cell: Cell, arm_a, rows_a, arm_b, rows_b):
    """Returns the least clearance [m] of the moving links of two arms on one grid of steps [k, dof]."""
    fractions = np.linspace(0, 1, 5)
    steps = zip(rows_a, rows_a[1:], rows_b, rows_b[1:], strict=False)
    return min(
        moving_clearance(cell, arm_a, a + f * (a_next - a), arm_b, b + f * (b_next - b))
        for a, a_next, b, b_next in steps
        for f in fractions
    )


def pair_clearance(cell: Cell, arm_a, q_a, arm_b, q_b):
    """Returns the clearance of two arms: moving links of each against all links of the other, no base-base pair."""
    a, b = cloud(cell, cell.arm(arm_a), q_a), cloud(cell, cell.arm(arm_b), q_b)
    return min(least_gap(a.moving, b.moving), least_gap(a.moving, b.base), least_gap(a.base, b.moving))


def base_clearance(cell: Cell, arm_name, q):
    """Returns the clearance of the moving links of one arm from the bases of all others."""
    own = cloud(cell, cell.arm(arm_name), q).moving
    others = [cloud(cell, arm, arm.robot.home).base for arm in cell.arms if arm.name != arm_name]
    return min((least_gap(own, other) for other in others), default=np.inf)


def obstacle_clearance(cell: Cell, arm_name, q):
    """Returns the clearance of the moving links of one arm from all obstacles."""
    own = cloud(cell, cell.arm(arm_name), q).moving
    return min((float((to_obstacle(own.centers, o) - own.radii).min()) for o in cell.obstacles), default=np.inf)


def self_pairs(cell: Cell, arm: Arm):
    """Returns the pairs of parts (low, high) of one arm that are tested against each other."""
    ignored = set(arm.robot.self_ignore[cell.spheres])
    names = part_names(arm)
    if arm.tool is not None:
        ignored |= {(names.index(link), len(names) - 1) for link in arm.tool.self_ignore[cell.spheres]}
    return [pair for pair in combinations(range(len(names)), 2) if pair not in ignored]


def self_clearance(cell: Cell, arm_name, q):
    """Returns the clearance of one arm from itself, over the pairs of parts that are not ignored, base included."""
    arm = cell.arm(arm_name)
    own = cloud(cell, arm, q)
    return min(
        (least_gap(own.only(own.parts == a), own.only(own.parts == b)) for a, b in self_pairs(cell, arm)),
        default=np.inf,
    )


def static_clearance(cell: Cell, arm_name, q):
    """Returns the clearance of one arm from static bodies and from itself, regardless of joint limits."""
    return min(
        obstacle_clearance(cell, arm_name, q), base_clearance(cell, arm_name, q), self_clearance(cell, arm_name, q)
    )


def within_limits(arm: Arm, q):
    """Returns whether every joint is within its limits, bounds included."""
    return bool(((q >= arm.robot.lower) & (q <= arm.robot.upper)).all())


def is_free(cell: Cell, arm_name, q, margin=0.0):
    """Returns whether an arm alone is valid at q: limits, obstacles, other arms' bases, self-collision."""
    return within_limits(cell.arm(arm_name), q) and static_clearance(cell, arm_name, q) >= margin


def clearance(cell: Cell, q):
    """Returns the least clearance of all pairs of arms, and of arms and obstacles, at `q`: arm name -> [dof]."""
    pairs = [pair_clearance(cell, a, q[a], b, q[b]) for a, b in combinations(cell.arm_names, 2)]
    return min([*pairs, *(obstacle_clearance(cell, arm, q[arm]) for arm in cell.arm_names)])


def least_clearance(cell: Cell, q):
    """Returns the least clearance at `q` of every kind: arms, obstacles, bases and self."""
    return min([clearance(cell, q), *(self_clearance(cell, arm, q[arm]) for arm in cell.arm_names)])
