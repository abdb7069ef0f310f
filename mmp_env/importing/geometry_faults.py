"""Faults of a robot's geometry: pieces that do not fit their geoms, spheres that do not cover the pieces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mmp_env.importing.checked_files import RobotFiles, RobotReport
from mmp_env.importing.cover_fit import fine_protrusion
from mmp_env.importing.cover_proof import protrusion, prove_cover
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece
from mmp_env.meshes.polytope import polytope
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.mujoco_import import mujoco

SPHERE_SETS = ("28", "fine")
_INSIDE_M = 1e-6
_TOO_LARGE_M = 0.0021
"""Largest distance [m] from a piece to the geom that it stands for."""


def hull_faults(files: RobotFiles) -> Iterator[str]:
    """Each geom of the MJCF lies in a piece of its link, which is hardly larger."""
    if files.hulls is None:
        yield "hulls.json is missing; the convex pieces are not known"
        return
    if set(files.hulls) != set(files.links):
        yield "hulls.json does not name the links of robot.json"
    for k, link in enumerate(files.links):
        geoms = [g for g in range(files.model.ngeom) if files.model.geom_bodyid[g] == files.model.body(link).id]
        pieces = files.arm.pieces[k]
        if len(geoms) != len(pieces):
            yield f"link '{link}' has {len(geoms)} geoms in the MJCF and {len(pieces)} convex pieces"
            continue
        for number, (geom, piece) in enumerate(zip(geoms, pieces, strict=True)):
            outside, larger = _misfit(files.model, geom, piece)
            if outside > _INSIDE_M:
                yield f"convex piece {number} of '{link}' leaves {outside * 1e3:.3f} mm of its geom outside"
            if larger > _TOO_LARGE_M:
                yield f"convex piece {number} of '{link}' is {larger * 1e3:.3f} mm larger than its geom"


def cover_faults(files: RobotFiles, report: RobotReport) -> Iterator[str]:
    """Each sphere set covers the pieces, proved, and protrudes by no more than it may."""
    if set(files.spheres) != set(SPHERE_SETS):
        yield f"the sphere sets are {', '.join(files.spheres)}; they must be {', '.join(SPHERE_SETS)}"
    for name, by_link in files.spheres.items():
        uncovered = largest = 0.0
        for link in by_link:
            if link not in files.links:
                yield f"set {name} has spheres for '{link}', which is no link"
        for k, link in enumerate(files.links):
            cover, pieces = files.arm.covers[name][k], files.arm.pieces[k]
            if not pieces:
                continue
            if cover is None:
                yield f"set {name} has no spheres for '{link}'"
                uncovered = np.inf
                continue
            if not (cover.radii > 0).all():
                yield f"set {name} has a sphere of '{link}' without a positive radius"
            shape = LinkShape(pieces)
            gaps = prove_cover(shape, cover.centers, cover.radii)
            if len(gaps.points):
                yield f"set {name} leaves up to {gaps.uncovered_mm:.3f} mm of '{link}' uncovered"
            uncovered = max(uncovered, gaps.uncovered_mm)
            out = protrusion(shape, cover.centers, cover.radii) * 1e3
            if not np.isfinite(out):
                yield f"set {name} has a sphere of '{link}' whose centre lies outside the link"
            elif name == "fine" and out > (allowed := fine_protrusion(shape) * 1e3):
                yield f"set fine protrudes from '{link}' by {out:.3f} mm; at most {allowed:g} mm are allowed"
            largest = max(largest, out)
        report.uncovered_mm[name], report.protrusion_mm[name] = uncovered, round(largest, 4)
        told = files.robot.get("protrusion_mm", {}).get(name)
        if told is not None and abs(told - largest) > 1e-3:
            yield f"robot.json says that set {name} protrudes by {told:g} mm; it is {largest:.4f} mm"


def _misfit(model: Any, geom: int, piece: Piece) -> tuple[float, float]:
    """How far [m] a geom sticks out of its piece, and the piece out of the geom, at sampled directions."""
    turn, place = matrix_from_quaternion(model.geom_quat[geom]), model.geom_pos[geom]
    directions = _directions(piece)
    local = directions @ turn
    size, kind = model.geom_size[geom], int(model.geom_type[geom])
    kinds = mujoco.mjtGeom
    if kind == int(kinds.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        support = (local @ model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].T.astype(float)).max(axis=1)
    elif kind == int(kinds.mjGEOM_BOX):
        support = np.abs(local) @ size
    elif kind == int(kinds.mjGEOM_SPHERE):
        support = np.full(len(local), size[0])
    elif kind == int(kinds.mjGEOM_CAPSULE):
        support = size[0] + np.abs(local[:, 2]) * size[1]
    elif kind == int(kinds.mjGEOM_CYLINDER):
        support = np.hypot(local[:, 0], local[:, 1]) * size[0] + np.abs(local[:, 2]) * size[1]
    else:
        support = np.linalg.norm(local * size, axis=1)
    support = support + directions @ place
    own = (directions @ piece.vertices.T).max(axis=1) + piece.radius
    return float((support - own).max()), float((own - support).max())


def _directions(piece: Piece) -> np.ndarray:
    """Directions in which a piece and its geom are compared: the normals of the piece, and to its vertices."""
    spread = np.random.default_rng(0).normal(size=(500, 3))
    parts = [spread, np.eye(3), -np.eye(3)]
    if len(piece.vertices) > 3:
        hull = polytope(piece.vertices)
        parts += [hull.planes[:, :3], hull.vertices - hull.vertices.mean(axis=0)]
    out = np.concatenate(parts)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
