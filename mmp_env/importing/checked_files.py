"""The files of a robot folder as they are read for its contract test, and the report of that test."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, in_words
from mmp_env.importing.arm_geometry import ArmGeometry, Kinematics
from mmp_env.importing.cover_fit import Cover
from mmp_env.importing.pieces import Piece
from mmp_env.model.transforms import matrix_from_rpy, transform
from mmp_env.mujoco_import import mujoco, without_log, without_report


@dataclass(kw_only=True, eq=False)
class RobotReport:
    """Faults of a robot folder, one sentence each, the properties that hold, and notes on what is approximate."""

    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    proved: list[str] = field(default_factory=list)
    uncovered_mm: dict[str, float] = field(default_factory=dict)
    protrusion_mm: dict[str, float] = field(default_factory=dict)

    def fields(self) -> dict[str, Any]:
        """Returns the report as JSON values."""
        return {
            "faults": self.faults,
            "notes": self.notes,
            "proved": self.proved,
            "uncovered_mm": self.uncovered_mm,
            "protrusion_mm": self.protrusion_mm,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotFiles:
    """Contents of a robot folder: `texts` by file name, the parsed files, the compiled MJCF and the arm's geometry.

    `hulls` is None where hulls.json is missing, and does not hold their origin. `from_meshes` tells that they stand for
    a vendor's meshes, which the geoms of the MJCF only approximate; `volumes_m3` are then the volumes of each link's
    hulls when they were made.
    """

    name: str
    texts: Mapping[str, str]
    robot: Mapping[str, Any]
    spheres: Mapping[str, Any]
    hulls: Mapping[str, Any] | None
    from_meshes: bool
    volumes_m3: Mapping[str, float]
    model: Any
    arm: ArmGeometry

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links, from the base on."""
        return self.arm.links

    @property
    def joints(self) -> list[dict[str, Any]]:
        """The joints as robot.json has them."""
        return self.robot["joints"]

    @property
    def limits(self) -> np.ndarray:
        """Lower and upper limits of the joints [dof, 2]."""
        return np.array([[joint["lower"], joint["upper"]] for joint in self.joints], dtype=float)

    @property
    def approximate_mm(self) -> dict[str, float]:
        """Sphere sets that make no claim to cover the pieces -> how far [mm] they leave a piece uncovered at most."""
        return self.robot.get("approximate_sets_mm", {})

    @property
    def solid(self) -> list[int]:
        """Numbers of the links that have geometry."""
        return [k for k, own in enumerate(self.arm.pieces) if own]


def read_robot_files(folder: Path, faults: list[str]) -> RobotFiles | None:
    """Returns what a robot folder holds, or None after a fault was added for each file that cannot be read."""
    texts = {}
    mjcf = f"{folder.name}.xml"
    for file in ("robot.json", "spheres.json", "hulls.json", mjcf):
        try:
            texts[file] = (folder / file).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            if file != "hulls.json":  # robots without hulls have spheres alone
                faults.append(f"{file} cannot be read: {in_words(error)}")
    if faults:
        return None
    try:
        robot, spheres = json.loads(texts["robot.json"]), json.loads(texts["spheres.json"])
        hulls = json.loads(texts.get("hulls.json", "null"))
        origin = hulls.pop("origin", {}) if hulls else {}
        with without_log(), without_report(beside_threads=True):
            model = mujoco.MjModel.from_xml_string(texts[mjcf])
        return RobotFiles(
            name=folder.name,
            texts=texts,
            robot=robot,
            spheres=spheres,
            hulls=hulls,
            from_meshes="meshes" in origin,
            volumes_m3=origin.get("volumes_m3", {}),
            model=model,
            arm=_arm_geometry(robot, spheres, hulls or {}),
        )
    except (ValueError, ArithmeticError, KeyError, TypeError, IndexError, AttributeError, MmpError) as error:
        faults.append(f"{folder.name} cannot be read: {in_words(error)}")
        return None


def pose_of(data: Any) -> np.ndarray:
    """Returns the matrix of a pose in robot.json."""
    return transform(matrix_from_rpy(data["rpy"]), data["xyz"])


def named(pair: Any) -> str:
    """Returns the names of two links with a hyphen between."""
    return "-".join(sorted(pair))


def _arm_geometry(robot: Any, spheres: Any, hulls: Any) -> ArmGeometry:
    joints, links = robot["joints"], tuple(robot["links"])
    limits = [[joint["lower"], joint["upper"]] for joint in joints]
    draw = np.array(robot.get("draw_limits", limits), dtype=float)
    return ArmGeometry(
        links=links,
        kinematics=Kinematics(
            origins=np.array([pose_of(joint["origin"]) for joint in joints]),
            axes=np.array([joint["axis"] for joint in joints], dtype=float),
            slide=np.array([joint.get("type") == "slide" for joint in joints]),
        ),
        pieces=tuple(
            tuple(
                Piece(vertices=np.array(piece["vertices"], dtype=float), radius=float(piece["radius"]))
                for piece in hulls.get(link, [])
            )
            for link in links
        ),
        covers={name: [_cover(by_link.get(link)) for link in links] for name, by_link in spheres.items()},
        lower=draw[:, 0],
        upper=draw[:, 1],
    )


def _cover(rows: Any) -> Cover | None:
    if not rows:
        return None
    table = np.array(rows, dtype=float).reshape(-1, 4)
    if not np.isfinite(table).all():
        raise MmpError("a sphere has a number that is not finite")
    return Cover(centers=table[:, :3], radii=table[:, 3], protrusion=0.0)
