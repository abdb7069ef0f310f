"""Makes hulls.json of the robots and tools here, and the sphere set `exact` that covers the hulls.

Usage: make_hulls.py --wheels FOLDER [NAME ...]. FOLDER holds the unpacked wheels `dm_robotics_panda` and `robosuite`,
each in a folder of that name. Only numbers are kept: the vertices of reduced outer hulls, at most 0.5 mm larger than
the hulls of the vendors' meshes. FR5 and PiPER have no mesh with a clear licence; their pieces are the geoms of their
MJCF.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import MmpError
from mmp_env.importing.cover_fit import fit_cover
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece, geom_pieces, mesh_piece
from mmp_env.model.robot import Robot
from mmp_env.model.robot_reading import load_robot
from mmp_env.model.transforms import matrix_from_rpy, transform

DATA = Path(__file__).parents[1] / "mmp_env"
PROTRUSION_M = 0.020
"""Largest protrusion [m] of the sphere set `exact`."""
FRAMES_AGREE_M = 1e-4
"""Largest distance [m] between a link of a vendor's model and ours where both have the same dimensions."""
PANDA = "dm_robotics_panda/dm_robotics/panda/assets/panda"
UR5E = "robosuite/robosuite/models/assets/robots/ur5e/meshes"
UR5E_MESHES = {
    "base": ("base.stl", (0, 0, 0), (0, 0, np.pi)),
    "shoulder": ("shoulder.stl", (0, 0, 0), (0, 0, np.pi)),
    "upperarm": ("upperarm.stl", (0, 0, 0.138), (np.pi / 2, 0, -np.pi / 2)),
    "forearm": ("forearm.stl", (0, 0, 0.007), (np.pi / 2, 0, -np.pi / 2)),
    "wrist1": ("wrist1.stl", (0, 0, -0.127), (np.pi / 2, 0, 0)),
    "wrist2": ("wrist2.stl", (0, 0, -0.0997), (0, 0, 0)),
    "wrist3": ("wrist3.stl", (0, 0, -0.0989), (np.pi / 2, 0, 0)),
}
"""Mesh, position [m] and roll, pitch, yaw in the frame of each link, as in the vendor's URDF."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """Pieces by link, and where they are from."""

    pieces: Mapping[str, tuple[Piece, ...]]
    origin: Mapping[str, Any]


def main() -> None:
    """Writes the files of all robots and tools, or of those named."""
    parser = Parser("make_hulls.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="robots and tools; all by default")
    parser.add_argument("--wheels", type=Path, required=True, metavar="FOLDER", help="unpacked wheels")
    args = parser.parse()
    sources = {
        "panda": lambda: panda(args.wheels),
        "franka-hand": lambda: hand(args.wheels),
        "ur5e": lambda: ur5e(args.wheels),
        "fr5": lambda: own_geoms("fr5"),
        "piper": lambda: own_geoms("piper"),
    }
    for name in args.names or sources:
        if name not in sources:
            raise MmpError(f"'{name}' has no hulls to make; known: {', '.join(sources)}")
        write(name, sources[name]())


def write(name: str, source: Source) -> None:
    """Writes hulls.json, and the set `exact` into spheres.json and robot.json or tool.json."""
    folder = next(DATA / kind / name for kind in ("robots", "tools") if (DATA / kind / name).is_dir())
    covers = {link: fit_cover(LinkShape(pieces), PROTRUSION_M) for link, pieces in source.pieces.items()}
    for link, cover in covers.items():
        vertices = [len(piece.vertices) for piece in source.pieces[link]]
        print(
            f"{name}/{link}: vertices {vertices}, {len(cover.radii)} spheres, {cover.protrusion * 1e3:.1f} mm",
            flush=True,
        )
    hulls = {
        link: [{"vertices": piece.vertices.tolist(), "radius": piece.radius} for piece in pieces]
        for link, pieces in source.pieces.items()
    }
    is_tool = folder.parent.name == "tools"
    volumes = {link: LinkShape(pieces).volume for link, pieces in source.pieces.items()}
    text = json.dumps({"origin": {**source.origin, "volumes_m3": volumes}, **hulls}, separators=(",", ":"))
    (folder / "hulls.json").write_text(text.replace('"radius"', '\n"radius"').replace("]],", "]],\n") + "\n")
    rows = {link: np.column_stack([cover.centers, cover.radii]).round(5).tolist() for link, cover in covers.items()}
    spheres = json.loads((folder / "spheres.json").read_text())
    spheres["exact"] = rows[name] if is_tool else rows
    (folder / "spheres.json").write_text(spheres_text(spheres))
    file = folder / ("tool.json" if is_tool else "robot.json")
    protrusion = round(max(cover.protrusion for cover in covers.values()) * 1e3 + 0.005, 2)
    print(f'{file}: add to self_collision_ignore the set exact, and "protrusion_mm": {{"exact": {protrusion}}}')


def spheres_text(spheres: Mapping[str, Any]) -> str:
    """Returns the text of a spheres.json with one sphere a line."""

    def block(value: Any, indent: str) -> str:
        if isinstance(value, dict):
            inner = ",\n".join(f'{indent}  "{key}": {block(item, indent + "  ")}' for key, item in value.items())
            return "{\n" + inner + "\n" + indent + "}"
        rows = ",\n".join(f"{indent}  {json.dumps(row)}" for row in value)
        return "[\n" + rows + "\n" + indent + "]"

    return block(spheres, "") + "\n"


def panda(wheels: Path) -> Source:
    """Returns the hulls of the Panda's links. Raises `MmpError` where the frames of the vendor's model differ."""
    model = mujoco.MjModel.from_xml_path(str(wheels / PANDA / "panda.xml"))
    robot = load_robot("panda")
    joints = [model.joint(f"panda_joint{k + 1}").qposadr[0] for k in range(robot.dof)]
    frames = same_frames(model, robot, joints, [f"panda_link{k}" for k in range(robot.dof + 1)])
    pieces = {
        link: (mesh_piece(mesh_points(wheels / PANDA / f"link{k}.obj") @ frames[k][:3, :3].T + frames[k][:3, 3]),)
        for k, link in enumerate(robot.link_names)
    }
    return Source(pieces=pieces, origin=panda_origin(wheels, [f"link{k}.obj" for k in range(8)]))


def hand(wheels: Path) -> Source:
    """Returns the hulls of the closed hand: the hand and both fingers, which are at 58.4 mm."""
    finger = mesh_points(wheels / PANDA / "finger.obj") + np.array([0, 0, 0.0584])
    meshes = [mesh_points(wheels / PANDA / "hand.obj"), finger, finger * [-1, -1, 1]]
    return Source(
        pieces={"franka-hand": tuple(map(mesh_piece, meshes))},
        origin=panda_origin(wheels, ["hand.obj", "finger.obj"]),
    )


def panda_origin(wheels: Path, files: list[str]) -> dict[str, Any]:
    """Returns origin and licence of the Panda's meshes."""
    return {
        "wheel": "dm_robotics_panda 0.4.8",
        "meshes": "franka_ros, Copyright 2017 Franka Emika GmbH",
        "licence": "Apache-2.0",
        "sha256": digests(wheels / PANDA, files),
    }


def ur5e(wheels: Path) -> Source:
    """Returns the hulls of the UR5e's links."""
    pieces = {}
    for link, (file, xyz, rpy) in UR5E_MESHES.items():
        pose = transform(matrix_from_rpy(rpy), xyz)
        pieces[link] = (mesh_piece(mesh_points(wheels / UR5E / file) @ pose[:3, :3].T + pose[:3, 3]),)
    origin = {
        "wheel": "robosuite 1.5.2",
        "meshes": "Universal_Robots_ROS2_Description, meshes/ur5e",
        "licence": "BSD-3-Clause",
        "sha256": digests(wheels / UR5E, [file for file, _, _ in UR5E_MESHES.values()]),
    }
    return Source(pieces=pieces, origin=origin)


def own_geoms(name: str) -> Source:
    """Returns the geoms of the MJCF of a robot as pieces."""
    robot = load_robot(name)
    model = mujoco.MjModel.from_xml_string(robot.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pieces = {}
    for link in robot.link_names:
        body = model.body(link).id
        world = transform(data.xmat[body].reshape(3, 3), data.xpos[body])
        geoms = np.flatnonzero((model.geom_bodyid == body) & ((model.geom_contype | model.geom_conaffinity) != 0))
        pieces[link] = tuple(_piece(geom_pieces(model, data, int(geom), world)) for geom in geoms)
    return Source(pieces=pieces, origin={"mjcf": f"{name}.xml", "licence": "Apache-2.0", "note": "geoms of the MJCF"})


def _piece(found: Piece | np.ndarray) -> Piece:
    assert isinstance(found, Piece)
    return found


def same_frames(
    model: mujoco.MjModel, robot: Robot, joints: list[int], bodies: list[str]
) -> list[Float[np.ndarray, "4 4"]]:
    """Returns the poses of a vendor's bodies in the frames of our links. Raises `MmpError` where they vary with q."""
    data = mujoco.MjData(model)
    seen = []
    for q in np.random.default_rng(0).uniform(robot.lower, robot.upper, (20, robot.dof)):
        data.qpos[joints] = q
        mujoco.mj_kinematics(model, data)
        base = model.body(bodies[0]).id
        world = transform(data.xmat[base].reshape(3, 3), data.xpos[base])
        row = []
        for body, ours in zip(bodies, link_poses(robot, q), strict=True):
            k = model.body(body).id
            row.append(np.linalg.inv(world @ ours) @ transform(data.xmat[k].reshape(3, 3), data.xpos[k]))
        seen.append(row)
    if np.abs(np.array(seen) - seen[0]).max() > FRAMES_AGREE_M:
        raise MmpError(f"{robot.name}: the vendor's frames move differently from ours")
    return [np.where(np.abs(pose - pose.round(6)) < 1e-5, pose.round(6), pose) for pose in seen[0]]


def link_poses(robot: Robot, q: Float[np.ndarray, "dof"]) -> Iterator[Float[np.ndarray, "4 4"]]:
    """Yields the poses of all links in the base frame."""
    pose = np.eye(4)
    yield pose
    for origin, axis, angle in zip(robot.origins, robot.axes, q, strict=True):
        turn, quaternion = np.zeros(9), np.zeros(4)
        mujoco.mju_axisAngle2Quat(quaternion, axis / np.linalg.norm(axis), angle)
        mujoco.mju_quat2Mat(turn, quaternion)
        pose = pose @ origin @ transform(turn.reshape(3, 3), np.zeros(3))
        yield pose


def mesh_points(file: Path) -> Float[np.ndarray, "v 3"]:
    """Returns the vertices of a mesh file in the file's frame."""
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=str(file), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    model = spec.compile()
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    return model.mesh_vert.astype(float) @ turn.reshape(3, 3).T + model.mesh_pos[0]


def digests(folder: Path, files: list[str]) -> dict[str, str]:
    """Returns the SHA-256 of files."""
    return {file: hashlib.sha256((folder / file).read_bytes()).hexdigest() for file in files}


if __name__ == "__main__":
    run_script(main)
