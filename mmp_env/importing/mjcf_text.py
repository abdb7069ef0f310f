"""The MJCF of an imported robot: primitive geoms, and hulls whose vertices stand in the file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.importing.arm_geometry import Kinematics
from mmp_env.importing.chain_links import Link
from mmp_env.importing.limits import Limits
from mmp_env.importing.pieces import Piece
from mmp_env.mujoco_import import mujoco

_FREQUENCY = 160.0
"""Natural frequency [rad/s] of the critically damped servos."""
_HEADROOM = 1.2
_LEAST_MASS, _LEAST_INERTIA = 1e-4, 1e-7
_SAMPLES = 100


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotParts:
    """All that the MJCF of a robot is made of, but its excluded contacts and its gains."""

    name: str
    links: tuple[Link, ...]
    kinematics: Kinematics
    pieces: tuple[tuple[Piece, ...], ...]
    limits: Limits
    flange: Float[np.ndarray, "4 4"]


def robot_mjcf(parts: RobotParts, excluded: Iterable[tuple[str, str]], gains: Float[np.ndarray, "dof"]) -> str:
    """Returns the MJCF of a robot: bodies named as the links, `joint1`..., `servo1`... and the site `flange`."""
    links, limits, kinematics = parts.links, parts.limits, parts.kinematics
    root = ET.Element("mujoco", model=parts.name)
    ET.SubElement(root, "compiler", angle="radian", balanceinertia="true")
    default = ET.SubElement(ET.SubElement(root, "default"), "default", {"class": "robot"})
    ET.SubElement(default, "joint", actuatorgravcomp="true")
    ET.SubElement(default, "geom", material="body", solref="0.01 1", solimp="0.95 0.99 0.001", priority="1")
    asset = ET.SubElement(root, "asset")
    ET.SubElement(asset, "material", name="body", rgba="0.93 0.93 0.92 1")
    parent = ET.SubElement(root, "worldbody")
    for k, link in enumerate(links):
        pose = np.eye(4) if k == 0 else kinematics.origins[k - 1]
        body = ET.SubElement(parent, "body", {"name": link.name, "gravcomp": "1", **_pose(pose)})
        if k == 0:
            body.set("childclass", "robot")
        ET.SubElement(body, "inertial", _inertial(link))
        if k > 0:
            joint = {
                "name": f"joint{k}",
                "axis": _text(kinematics.axes[k - 1]),
                "armature": f"{limits.armature[k - 1]:.6g}",
            }
            if kinematics.slide[k - 1]:
                joint["type"] = "slide"
            joint["range"] = _text([limits.lower[k - 1], limits.upper[k - 1]])
            ET.SubElement(body, "joint", joint)
        for number, piece in enumerate(parts.pieces[k]):
            _add_geom(asset, body, f"{link.name}_{number}", piece)
        parent = body
    ET.SubElement(parent, "site", {"name": "flange", "size": "0.005", "group": "4", **_pose(parts.flange)})
    contact = ET.SubElement(root, "contact")
    for first, second in sorted(excluded):
        ET.SubElement(contact, "exclude", body1=first, body2=second)
    actuator = ET.SubElement(root, "actuator")
    for k, gain in enumerate(gains, start=1):
        ET.SubElement(
            actuator,
            "position",
            name=f"servo{k}",
            joint=f"joint{k}",
            kp=f"{gain:.3g}",
            kv=f"{2 * gain / _FREQUENCY:.4g}",
        )
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def tool_mjcf(name: str, link: Link, pieces: Sequence[Piece], point: Float[np.ndarray, "3"]) -> str:
    """Returns the MJCF of a tool: one body named as the tool, and the site `tool_point`.

    Other names begin with that of the tool, because tool and arm share one prefix in a cell.
    """
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", angle="radian", balanceinertia="true")
    default = ET.SubElement(ET.SubElement(root, "default"), "default", {"class": f"{name}-tool"})
    ET.SubElement(default, "geom", material=f"{name}-body", solref="0.01 1", solimp="0.95 0.99 0.001", priority="1")
    asset = ET.SubElement(root, "asset")
    ET.SubElement(asset, "material", name=f"{name}-body", rgba="0.35 0.36 0.38 1")
    world = ET.SubElement(root, "worldbody")
    body = ET.SubElement(world, "body", {"name": name, "gravcomp": "1", "childclass": f"{name}-tool"})
    ET.SubElement(body, "inertial", _inertial(link))
    for number, piece in enumerate(pieces):
        _add_geom(asset, body, f"{name}-tool_{number}", piece)
    ET.SubElement(body, "site", {"name": "tool_point", "size": "0.005", "group": "4", "pos": _text(point)})
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def servo_gains(mjcf: str, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Returns position gains that damp each joint critically where its inertia is largest."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    inertia, full = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    for _ in range(_SAMPLES):
        data.qpos[:] = random.uniform(lower, upper)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        for j in range(model.nv):  # M e_j: the same call in all versions of MuJoCo
            unit = np.zeros(model.nv)
            unit[j] = 1.0
            mujoco.mj_mulM(model, data, full[j], unit)
        inertia = np.maximum(inertia, np.diag(full))
    return _HEADROOM * _FREQUENCY**2 * inertia


def _add_geom(asset: ET.Element, body: ET.Element, name: str, piece: Piece) -> None:
    kind = piece.geom["type"]
    if kind == "mesh":
        ET.SubElement(asset, "mesh", name=name, vertex=_text(piece.vertices.ravel()), inertia="convex")
        ET.SubElement(body, "geom", type="mesh", mesh=name)
        return
    size = {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)
    place = {"pos": _text(piece.geom["pos"]), "quat": _text(piece.geom["quat"])}
    ET.SubElement(body, "geom", {"type": kind, "size": _text(piece.geom["size"][:size]), **place})


def _inertial(link: Link) -> dict[str, str]:
    mass = max(link.mass, _LEAST_MASS)
    inertia = link.inertia + np.eye(3) * _LEAST_INERTIA
    terms = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    return {"pos": _text(link.center), "mass": f"{mass:.9g}", "fullinertia": _text(terms)}


def _pose(pose: np.ndarray) -> dict[str, str]:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(pose[:3, :3]).ravel())
    return {"pos": _text(pose[:3, 3]), "quat": _text(quaternion)}


def _text(values: Any) -> str:
    return " ".join(f"{float(x) + 0.0:.12g}" for x in values)
