"""Sphere clouds of all arms, and the spheres in contact, which are red."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from mmp_env.check.distance import solid_distance
from mmp_env.model.cell import Cell
from mmp_env.model.convex_hull import plane_distance, supporting_planes
from mmp_env.model.joint_chain import untested_pairs
from mmp_env.model.margins import Margins
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.view.rerun.colors import CONTACT, arm_colors
from mmp_env.view.rerun.sdk import entity_part, require

Configurations = Mapping[str, Float[np.ndarray, "t dof"]]


def send_clouds(stream: Any, root: str, index: list[Any], cell: Cell, q: Configurations, margins: Margins) -> None:
    """Sends the spheres of every arm at `q`, a row per time of `index`, as points `<root>/<arm>` with their radii."""
    log_radii(stream, root, cell, static=True)
    send_centers(stream, root, index, cell, q, margins)


def log_radii(stream: Any, root: str, cell: Cell, *, static: bool) -> None:
    """Logs the radii of all spheres, for all times or from the current time of the stream."""
    for arm in cell.arms:
        radii = cell.collision.spheres(arm.name, arm.robot.home[None])[1]
        stream.log(f"{root}/{entity_part(arm.name)}", require().Points3D.from_fields(radii=radii), static=static)


def send_centers(stream: Any, root: str, index: list[Any], cell: Cell, q: Configurations, margins: Margins) -> None:
    """Sends what `send_clouds` sends, without the radii.

    Spheres closer than `margins` [m] to another arm, an obstacle or another part of their own arm are red.
    """
    rerun, colors = require(), arm_colors(cell)
    touching = touching_spheres(cell, q, margins)
    for name, rows in q.items():
        centers, radii = cell.collision.spheres(name, rows)
        hit = touching.get(name, np.zeros(centers.shape[:2], bool))
        columns = rerun.Points3D.columns(
            positions=centers.reshape(-1, 3).astype(np.float32), colors=contact_colors(colors[name], hit).reshape(-1, 3)
        )
        stream.send_columns(f"{root}/{entity_part(name)}", index, columns.partition([len(radii)] * len(rows)))


def contact_colors(color: UInt8[np.ndarray, "3"], touching: Bool[np.ndarray, "*n"]) -> UInt8[np.ndarray, "*n 3"]:
    """Returns a colour per sphere: red in contact, the arm's colour otherwise."""
    return np.where(touching[..., None], np.array(CONTACT, np.uint8), color)


def touching_spheres(cell: Cell, q: Configurations, margins: Margins) -> dict[str, Bool[np.ndarray, "t s"]]:
    """Returns arm -> mask [t, s] of its spheres closer than `margins` [m] to anything; clear arms are left out.

    The others are another arm, an obstacle, or another part of the same arm. Only if the native core finds less than
    the margin, all pairs of spheres are compared.
    """
    names = list(q)
    out = {name: mask for name in names if (mask := touching_obstacles_or_self(cell, name, q[name], margins)).any()}
    for k, a in enumerate(names):
        for b in names[k + 1 :]:
            near = np.flatnonzero(cell.collision.pair_clearance(a, q[a], b, q[b]) < margins.arms)
            if not len(near):
                continue
            hits = sphere_gaps(sphere_cloud(cell, a, q[a][near]), sphere_cloud(cell, b, q[b][near])) < margins.arms
            for name, hit in ((a, np.any(hits, axis=2)), (b, np.any(hits, axis=1))):
                mask = out.setdefault(name, np.zeros((len(q[name]), hit.shape[1]), bool))
                mask[near] |= hit
    return out


def touching_obstacles_or_self(
    cell: Cell, arm: str, q: Float[np.ndarray, "t dof"], margins: Margins
) -> Bool[np.ndarray, "t s"]:
    """Returns the mask [t, s] of spheres closer than `margins` [m] to an obstacle or another part of the same arm."""
    near = np.flatnonzero(cell.collision.static_clearance(arm, q) < max(margins.obstacles, margins.self))
    own = sphere_cloud(cell, arm, q[near])
    out = np.zeros((len(q), len(own.radii)), bool)
    if len(near):
        out[near] = _in_obstacles(cell, own, margins.obstacles) | _in_itself(own, self_pairs(cell, arm), margins.self)
    return out


def _in_obstacles(cell: Cell, own: SphereCloud, margin: float) -> Bool[np.ndarray, "n s"]:
    """Returns the mask of spheres near obstacles. Like the native core it tests moving links only."""
    out = np.zeros(own.centers.shape[:2], bool)
    for solid in cell.obstacles:
        there = (own.centers - solid.position) @ matrix_from_quaternion(solid.quaternion)
        if solid.pieces:
            apart = np.min([plane_distance(supporting_planes(piece), there) for piece in solid.pieces], axis=0)
        else:
            apart = solid_distance(solid.shape, solid.half_size, there)[0]
        out |= apart - own.radii < margin
    return out & ~own.is_base


def _in_itself(own: SphereCloud, pairs: Int[np.ndarray, "p 2"], margin: float) -> Bool[np.ndarray, "n s"]:
    i, j = pairs.T
    gaps = np.linalg.norm(own.centers[:, i] - own.centers[:, j], axis=2) - own.radii[i] - own.radii[j]
    out = np.zeros(own.centers.shape[:2], bool)
    rows, found = np.nonzero(gaps < margin)
    out[rows, i[found]] = out[rows, j[found]] = True
    return out


class SphereCloud(NamedTuple):
    """Spheres of an arm: centres [m], radii [m], and which of them belong to its base."""

    centers: Float[np.ndarray, "n s 3"]
    radii: Float[np.ndarray, "s"]
    is_base: Bool[np.ndarray, "s"]


def sphere_cloud(cell: Cell, arm: str, q: Float[np.ndarray, "n dof"]) -> SphereCloud:
    """Returns the spheres of an arm at `q` [n, dof]."""
    return SphereCloud(*cell.collision.spheres(arm, q), cell.collision.is_base(arm))


def sphere_gaps(a: SphereCloud, b: SphereCloud) -> Float[np.ndarray, "n s_a s_b"]:
    """Returns the distances between the surfaces of all spheres of two arms [m]; infinite between the two bases."""
    apart = a.centers[:, :, None] - b.centers[:, None]
    gaps = np.sqrt(np.einsum("nabi,nabi->nab", apart, apart)) - a.radii[:, None] - b.radii
    gaps[:, np.logical_and.outer(a.is_base, b.is_base)] = np.inf
    return gaps


@lru_cache(maxsize=64)
def self_pairs(cell: Cell, arm: str) -> Int[np.ndarray, "p 2"]:
    """Returns the pairs of an arm's spheres that must not touch: those of links that the robot's data do not exempt."""
    parts, untested = cell.collision.sphere_links(arm), untested_pairs(cell.arm(arm), cell.spheres)
    tested = {(a, b) for a in set(parts) for b in set(parts) if a != b and frozenset((a, b)) not in untested}
    pairs = [(i, j) for (i, a), (j, b) in combinations(enumerate(parts), 2) if (a, b) in tested]
    out = np.array(pairs, dtype=int).reshape(-1, 2)
    out.setflags(write=False)
    return out
