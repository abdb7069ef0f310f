"""Imports an arm into a robot folder of robot.json, spheres.json, hulls.json and MJCF, whole or not at all."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.files.writing import json_text
from mmp_env.importing.arm_geometry import ArmGeometry, Kinematics
from mmp_env.importing.chain import Chain, select_chain
from mmp_env.importing.chain_choice import ChainOptions
from mmp_env.importing.cover_fit import (
    COARSE_EFFORT,
    FINE_EFFORT,
    FINE_M,
    Cover,
    CoverError,
    coarse_covers,
    fit_coarse_cover,
)
from mmp_env.importing.fingerprint import fingerprints
from mmp_env.importing.folder_writing import read_folder, write_folder
from mmp_env.importing.limits import Limits, limits_of
from mmp_env.importing.link_covers import fine_covers, link_shapes
from mmp_env.importing.link_pieces import pieces_and_notes
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.mjcf_text import RobotParts, robot_mjcf, servo_gains
from mmp_env.importing.pieces import Piece
from mmp_env.importing.poses import choose_poses, given_poses
from mmp_env.importing.self_pairs import SAMPLES, SelfPairs, classify, tested_by_set
from mmp_env.importing.source import PreparedSource, prepare_source
from mmp_env.importing.target_folder import Imported, TargetFolder
from mmp_env.importing.workspace import horizontal_reach, ring_height
from mmp_env.model.robot import EXACT
from mmp_env.robot_folders import DESCRIPTION

VERSION = 7
"""Version of the importer's results. The cache holds results of the same version only."""
COARSE_SPHERES = (28, 42, 63)
"""Numbers of spheres that the moving links have in set `28`; the next one is tried where too few poses are free."""
_LEAST_FREE = 20
LONGEST_LINK_M = 20.0
"""Largest extent of a link. The spheres that cover a larger one, as closely, could fill the memory."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Detail:
    """Sphere sets of an import: the name of the finest, how much more it protrudes than `fine`, and sizes of the other.

    The next of `coarse_spheres` is tried where too few poses are free; None: there is no coarse set.
    """

    finest: str = "fine"
    coarser: float = 1.0
    coarse_spheres: tuple[int | None, ...] = COARSE_SPHERES


ALL_SETS = Detail()
COVER_OF_HULLS = Detail(finest=EXACT, coarser=4.0, coarse_spheres=(None,))
"""Only the cover that exact geometry needs. It protrudes by 20 mm, as do those of the built-in robots."""


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Options of an import. The folder is called `name`."""

    name: str
    chain: ChainOptions = field(default_factory=ChainOptions)
    package_dirs: tuple[str, ...] = ()


def add_robot(
    source: str | Path, out: str | Path, options: ImportOptions, *, cache: str | Path | None, progress: Progress
) -> Imported:
    """Imports the arm in a URDF or MJCF file into the folder `out`/name.

    Args:
        source: The file.
        out: Folder that gets the robot's folder.
        options: Name and choice of the chain.
        cache: Folder of earlier results, or None.
        progress: Called with a line for each step.

    Raises:
        MmpError: if the source cannot be imported or the folder may not or cannot be written. Then nothing is written.
    """
    prepared = prepare_source(source, options.package_dirs)
    place = TargetFolder(out=Path(out), name=options.name, kind="robot", description=DESCRIPTION)
    place.checked(prepared.inputs)
    kept = Path(cache) / _key(prepared, options) if cache is not None else None
    from_cache = kept is not None and exists(kept / DESCRIPTION)
    if kept is not None and from_cache:
        files = read_folder(kept)
    else:
        files = robot_files(select_chain(prepared.compiled(), options.chain), options.name, progress)
    if kept is not None and not from_cache:
        write_folder(kept, files)
    target = place.checked(prepared.inputs)  # an import takes long enough for the folder to change
    replaced = exists(target)
    write_folder(target, files)
    return Imported(folder=target, from_cache=from_cache, replaced=replaced)


def robot_files(chain: Chain, name: str, progress: Progress) -> dict[str, str]:
    """Returns the content of the robot's files by name. Raises `MmpError`."""
    pieces: list[tuple[Piece, ...]] = []
    notes = list(chain.source.notes)
    for link in chain.links:
        own, faults = pieces_and_notes(chain, link)
        pieces.append(own)
        notes += faults
        progress(f"{link.name}: {len(own)} convex pieces")
    return files_of_pieces(replace(chain, notes=tuple(notes)), name, pieces, progress)


def files_of_pieces(
    chain: Chain,
    name: str,
    pieces: Sequence[tuple[Piece, ...]],
    progress: Progress,
    detail: Detail = ALL_SETS,
) -> dict[str, str]:
    """Returns the content of the robot's files by name, with these pieces of each link. Raises `MmpError`."""
    limits = limits_of(chain)
    if not any(pieces[1:]):
        raise MmpError(f"{chain.source.path}: no link that moves has collision geometry")
    for link, own in zip(chain.links, pieces, strict=True):
        if own and (length := _extent(own)) > LONGEST_LINK_M:
            raise MmpError(
                f"{chain.source.path}: link '{link.name}' is {length:.4g} m long, and {LONGEST_LINK_M:g} m is the most;"
                " are its lengths in millimetres? They must be in metres"
            )
    shapes = link_shapes(pieces)
    try:
        effort = FINE_EFFORT if detail is ALL_SETS else COARSE_EFFORT
        names = [link.name for link in chain.links]
        fine = fine_covers(names, shapes, progress, detail.coarser * FINE_M, effort)
    except CoverError as error:
        raise MmpError(f"{chain.source.path}: no sphere cover was found: {error}") from None
    frames = [link.frame for link in chain.links]
    origins = np.array([np.linalg.inv(frames[k]) @ frames[k + 1] for k in range(len(frames) - 1)])
    kinematics = Kinematics(origins=origins, axes=chain.axes, slide=np.array(chain.is_slide))
    parts = RobotParts(
        name=name,
        links=chain.links,
        kinematics=kinematics,
        pieces=tuple(pieces),
        limits=limits,
        flange=chain.flange,
    )
    fit = functools.cache(fit_coarse_cover)
    for budget in detail.coarse_spheres:
        covers = {detail.finest: fine}
        if budget is not None:
            coarse = coarse_covers(shapes, budget, fit)
            progress(f"set 28: {sum(len(c.radii) for c in coarse[1:] if c)} spheres on the moving links")
            covers = {"28": coarse} | covers
        arm = ArmGeometry(
            links=tuple(link.name for link in chain.links),
            kinematics=kinematics,
            pieces=tuple(pieces),
            covers=covers,
            lower=limits.draw[:, 0],
            upper=limits.draw[:, 1],
        )
        plain = robot_mjcf(parts, [(arm.links[i], arm.links[j]) for i, j in arm.neighbours()], np.ones(len(origins)))
        pairs = classify(arm, plain, chain.apart)
        progress(f"{SAMPLES} configurations: {len(pairs.tested)} pairs of links can touch")
        tested = tested_by_set(arm, pairs)
        drawn = arm.draw(SAMPLES, 0)[pairs.free]
        least = 1 if budget == detail.coarse_spheres[-1] else min(_LEAST_FREE, len(drawn))
        poses = choose_poses(arm, plain, tested, given_poses(chain), drawn, max(1, least))
        if poses is not None:
            break
    else:
        raise MmpError(f"{chain.source.path}: no configuration was found that is free of self-collision")
    common = set.intersection(*(set(pairs.of_set(key)) for key in arm.covers))
    neighbours = {(arm.links[k], arm.links[k + 1]) for k in range(len(origins))}
    mjcf = robot_mjcf(parts, common | neighbours, servo_gains(plain, arm.lower, arm.upper))
    spheres = {key: _spheres(arm, covers) for key, covers in arm.covers.items()}
    hulls = {
        link: [{"vertices": piece.vertices.tolist(), "radius": piece.radius} for piece in own]
        for link, own in zip(arm.links, pieces, strict=True)
    }
    robot = _robot(chain, arm, limits, pairs, poses, shapes)
    texts = {"spheres.json": json_text(spheres), "hulls.json": json_text(hulls), f"{name}.xml": mjcf}
    robot["fingerprints"] = fingerprints(robot, texts)
    return {"robot.json": json_text(robot), **texts}


def summary(folder: Path) -> dict[str, Any]:
    """Returns what a robot folder holds, in numbers, as `--json` prints it."""
    robot = json.loads((folder / "robot.json").read_text(encoding="utf-8"))
    spheres = json.loads((folder / "spheres.json").read_text(encoding="utf-8"))
    return {
        "name": folder.name,
        "title": robot["title"],
        "joints": len(robot["joints"]),
        "links": len(robot["links"]),
        "joint_names": [joint["name"] for joint in robot["joints"]],
        "link_names": robot["links"],
        "spheres": {key: sum(map(len, by_link.values())) for key, by_link in spheres.items()},
        "protrusion_mm": robot["protrusion_mm"],
        "uncovered_mm": robot["uncovered_mm"],
        "self_pairs_ignored": robot["self_pairs_ignored"],
        "root": robot["imported"]["root"],
        "tip": robot["imported"]["tip"],
        "held": robot["imported"]["held"],
        "notes": robot["notes"],
        "folder": str(folder),
    }


def _extent(pieces: Sequence[Piece]) -> float:
    """Returns the longest edge [m] of the box around pieces along the axes of their link."""
    low = np.min([piece.vertices.min(axis=0) - piece.radius for piece in pieces], axis=0)
    high = np.max([piece.vertices.max(axis=0) + piece.radius for piece in pieces], axis=0)
    return float((high - low).max())


def _robot(
    chain: Chain,
    arm: ArmGeometry,
    limits: Limits,
    pairs: SelfPairs,
    poses: tuple[np.ndarray, np.ndarray],
    shapes: Sequence[LinkShape | None],
) -> dict[str, Any]:
    home, tucked = poses
    joints = [
        {
            "name": name,
            "type": "slide" if chain.is_slide[k] else "hinge",
            "origin": _pose(arm.kinematics.origins[k]),
            "axis": chain.axes[k].tolist(),
            "lower": float(limits.lower[k]),
            "upper": float(limits.upper[k]),
            "velocity": float(limits.velocity[k]),
            "acceleration": float(limits.acceleration[k]),
            "jerk": float(limits.jerk[k]),
            "effort": float(limits.effort[k]),
        }
        for k, name in enumerate(chain.joint_names)
    ]
    left_out = {key: pairs.of_set(key) for key in arm.covers}
    empty = [name for name, own in zip(arm.links, arm.pieces, strict=True) if not own]
    notes = [*limits.notes, *chain.notes]
    if empty:
        notes.append(f"links without collision geometry: {', '.join(empty)}")
    if (height := ring_height(arm)) > 0:
        notes.append(f"links hang below the base: rings and lines put the base {height:g} m above their table")
    if chain.held:
        notes.append(f"joints that are no part of the arm are held at their value: {', '.join(chain.held)}")
    return {
        "title": f"{chain.source.title}, imported from {chain.source.path.name}",
        "reach": horizontal_reach(arm, chain.flange),
        "links": list(arm.links),
        "joints": joints,
        "flange": _pose(chain.flange),
        "home": home.tolist(),
        "tucked": tucked.tolist(),
        "draw_limits": limits.draw.tolist(),
        "default_tool": None,
        "ring_spheres": "exact",
        "ring_height": height,
        "acceleration_published": False,
        "self_collision_ignore": {key: [list(pair) for pair in left] for key, left in left_out.items()},
        "self_pairs_ignored": [
            {key: value for key, value in asdict(pair).items() if value is not None} for pair in pairs.ignored
        ],
        "self_pairs_tested": [[arm.links[i], arm.links[j]] for i, j in pairs.tested],
        "hull_volumes_m3": {
            name: shape.volume for name, shape in zip(arm.links, shapes, strict=True) if shape is not None
        },
        "protrusion_mm": {
            key: round(max(cover.protrusion for cover in covers if cover is not None) * 1e3, 4)
            for key, covers in arm.covers.items()
        },
        "uncovered_mm": 0.0,
        "imported": {
            "source": chain.source.path.name,
            "sha256": chain.source.digest,
            "importer": VERSION,
            "root": chain.root,
            "tip": chain.tip,
            "held": list(chain.held),
        },
        "sources": [],
        "notes": notes,
    }


def _spheres(arm: ArmGeometry, covers: Sequence[Cover | None]) -> dict[str, list[list[float]]]:
    return {
        name: [[*center, radius] for center, radius in zip(cover.centers.tolist(), cover.radii.tolist(), strict=True)]
        for name, cover in zip(arm.links, covers, strict=True)
        if cover is not None
    }


def _pose(pose: np.ndarray) -> dict[str, list[float]]:
    """Position and fixed-axis roll, pitch, yaw, so that Rz(yaw) Ry(pitch) Rx(roll) is the rotation."""
    r = pose[:3, :3]
    pitch = float(np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0])))
    if np.hypot(r[0, 0], r[1, 0]) > 1e-9:
        roll, yaw = float(np.arctan2(r[2, 1], r[2, 2])), float(np.arctan2(r[1, 0], r[0, 0]))
    else:
        roll, yaw = float(np.arctan2(-r[1, 2], r[1, 1])), 0.0
    return {"xyz": (pose[:3, 3] + 0.0).tolist(), "rpy": [roll, pitch, yaw]}


def _key(model: PreparedSource, options: ImportOptions) -> str:
    said = json.dumps([VERSION, model.digest, model.path.name, asdict(replace(options, package_dirs=()))])
    return hashlib.sha256(said.encode()).hexdigest()[:40]
