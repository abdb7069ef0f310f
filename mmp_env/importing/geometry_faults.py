"""Faults of a robot's geometry: pieces that do not fit their geoms, spheres that do not cover the pieces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from mmp_env.importing.checked_files import RobotFiles, RobotReport
from mmp_env.importing.cover_fit import FINE_M, Cover
from mmp_env.importing.cover_proof import protrusion, prove_cover
from mmp_env.importing.kinematic_tree import pose_matrix
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import HULL_TOLERANCE_M, ROUNDING_M, Piece, geom_pieces
from mmp_env.mujoco_import import mujoco

SPHERE_SETS = ("28", "fine")
_SAME_M = 5e-6
"""Largest distance [m] between vertices of a piece and of its geom, which are rounded differently."""
_VOLUME_SHARE = 1e-6
"""Largest relative difference of the volumes of the pieces from those when they were made."""
_OUTER_SHARE = 0.03
"""Largest share by which outer hulls may be larger than the hulls of a vendor's meshes."""
_TOLD_LESS_MM, _TOLD_MORE_MM = 1e-3, 0.02
"""Largest differences [mm] of the protrusion in robot.json from that of the spheres: below it and above it."""


def hull_faults(files: RobotFiles) -> Iterator[str]:
    """Each geom of the MJCF lies in a piece of its link, which is hardly larger; volumes are those of the import."""
    if files.hulls is None:
        yield "hulls.json is missing; the convex pieces are not known"
        return
    if set(files.hulls) != set(files.links):
        yield "hulls.json does not name the links of robot.json"
    for k, link in enumerate(files.links):
        pieces = files.arm.pieces[k]
        yield from _volume_faults(files, link, pieces)
        if not files.from_meshes:
            yield from _piece_faults(files, link, pieces)


def _volume_faults(files: RobotFiles, link: str, pieces: Sequence[Piece]) -> Iterator[str]:
    """The pieces of a link are as large as when they were made, and as the vendor's meshes or hardly larger."""
    of_meshes = files.robot.get("hull_volumes_m3", {}).get(link)
    made = files.volumes_m3.get(link) if files.from_meshes else of_meshes
    if of_meshes is None or not (files.from_meshes or "imported" in files.robot):
        return
    volume = LinkShape(pieces).volume if pieces else 0.0
    if made is not None and abs(volume / made - 1) > _VOLUME_SHARE:
        yield f"the pieces of '{link}' have {volume:.9f} m^3; they were made with {made:.9f} m^3"
    larger = volume / of_meshes - 1
    if not -_VOLUME_SHARE <= larger <= _OUTER_SHARE:
        yield f"the pieces of '{link}' are {larger:+.4%} larger than robot.json says"


def _piece_faults(files: RobotFiles, link: str, pieces: Sequence[Piece]) -> Iterator[str]:
    """The pieces of a link are those of the geoms of its body."""
    data = mujoco.MjData(files.model)
    mujoco.mj_kinematics(files.model, data)
    body = files.model.body(link).id
    geoms = [g for g in range(files.model.ngeom) if files.model.geom_bodyid[g] == body]
    if len(geoms) != len(pieces):
        yield f"link '{link}' has {len(geoms)} geoms in the MJCF and {len(pieces)} convex pieces"
        return
    for number, (geom, piece) in enumerate(zip(geoms, pieces, strict=True)):
        if not (files.model.geom_contype[geom] and files.model.geom_conaffinity[geom]):
            yield f"geom {number} of '{link}' in the MJCF collides with nothing"
        expected = geom_pieces(files.model, data, geom, pose_matrix(data.xpos[body], data.xmat[body]))
        is_mesh = not isinstance(expected, Piece)
        vertices, radius = (expected, piece.radius) if is_mesh else (expected.vertices, expected.radius)
        apart = max(_farthest(vertices, piece.vertices), _farthest(piece.vertices, vertices))
        apart = max(apart, abs(piece.radius - radius))
        if apart > _SAME_M:
            yield f"convex piece {number} of '{link}' and its geom in the MJCF differ by {apart * 1e3:.4f} mm"
        if is_mesh and not 0 <= piece.radius <= HULL_TOLERANCE_M + 3 * ROUNDING_M:
            yield f"convex piece {number} of '{link}' has radius {piece.radius * 1e3:.3f} mm"


def cover_faults(files: RobotFiles, report: RobotReport) -> Iterator[str]:
    """Each sphere set covers the pieces, proved, and protrudes by no more than it may."""
    if set(files.spheres) - {"exact"} != set(SPHERE_SETS):
        yield f"the sphere sets are {', '.join(files.spheres)}; they must be {', '.join(SPHERE_SETS)}"
    shapes = [LinkShape(pieces) if pieces else None for pieces in files.arm.pieces]
    for name, by_link in files.spheres.items():
        for link in by_link:
            if link not in files.links:
                yield f"set {name} has spheres for '{link}', which is no link"
        covers = [
            (link, cover, shape)
            for link, cover, shape in zip(files.links, files.arm.covers[name], shapes, strict=True)
            if shape is not None
        ]
        for link, cover, _ in covers:
            if cover is not None and not (cover.radii > 0).all():
                yield f"set {name} has a sphere of '{link}' without a positive radius"
        told = files.approximate_mm.get(name)
        if told is None:
            yield from _proof_faults(files, report, name, covers)
        else:
            yield from _approximation_faults(report, name, covers, told)


def _proof_faults(
    files: RobotFiles, report: RobotReport, name: str, covers: Sequence[tuple[str, Cover | None, LinkShape]]
) -> Iterator[str]:
    """A sphere set covers every link, and protrudes by as much as robot.json says."""
    uncovered = largest = 0.0
    for link, cover, shape in covers:
        if cover is None:
            yield f"set {name} has no spheres for '{link}'"
            uncovered = np.inf
            continue
        gaps = prove_cover(shape, cover.centers, cover.radii)
        if len(gaps.points):
            yield f"set {name} leaves up to {gaps.uncovered_mm:.3f} mm of '{link}' uncovered"
        uncovered = max(uncovered, gaps.uncovered_mm)
        out = protrusion(shape, cover.centers, cover.radii) * 1e3
        if not np.isfinite(out):
            yield f"set {name} has a sphere of '{link}' whose centre lies outside the link"
        elif name == "fine" and out > FINE_M * 1e3:
            yield f"set fine protrudes from '{link}' by {out:.3f} mm; at most {FINE_M * 1e3:g} mm are allowed"
        largest = max(largest, out)
    report.uncovered_mm[name], report.protrusion_mm[name] = uncovered, round(largest, 4)
    told = files.robot.get("protrusion_mm", {}).get(name)
    if told is not None and not -_TOLD_LESS_MM <= told - largest <= _TOLD_MORE_MM:
        yield f"robot.json says that set {name} protrudes by {told:g} mm; it is {largest:.4f} mm"


def _approximation_faults(
    report: RobotReport, name: str, covers: Sequence[tuple[str, Cover | None, LinkShape]], told: float
) -> Iterator[str]:
    """A sphere set that only approximates the links leaves no more uncovered than robot.json says."""
    uncovered = {
        link: np.inf if cover is None else prove_cover(shape, cover.centers, cover.radii).uncovered_mm
        for link, cover, shape in covers
    }
    link = max(uncovered, key=lambda link: uncovered[link])
    report.uncovered_mm[name] = uncovered[link]
    if uncovered[link] > told:
        yield f"set {name} leaves up to {uncovered[link]:.3f} mm of '{link}' uncovered; robot.json says {told:g} mm"
    else:
        report.notes.append(
            f"set {name} approximates the links: it leaves up to {uncovered[link]:.2f} mm of '{link}' uncovered"
        )


def _farthest(points: Float[np.ndarray, "n 3"], others: Float[np.ndarray, "m 3"]) -> float:
    """The largest distance [m] from a point to the nearest of the others."""
    return float(np.linalg.norm(points[:, None] - others, axis=2).min(axis=1).max())
