"""Robots of whole models: the arm of a model as robot files, which the cache keeps by content."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.importing.chain import Chain
from mmp_env.importing.folder_writing import write_folder
from mmp_env.importing.limits import limits_of
from mmp_env.importing.pieces import Piece, geom_pieces, mesh_piece
from mmp_env.importing.robot_folder import COVER_OF_HULLS, VERSION, files_of_pieces
from mmp_env.model.robot import Robot
from mmp_env.model.robot_reading import load_robot
from mmp_env.mujoco_import import mujoco
from mmp_env.robot_folders import cache_folder

_DECIMALS = 9
"""Decimals of the numbers by which two arms are the same."""
_SHORT = 12


def scene_robot(chain: Chain) -> Robot:
    """Returns the robot of a chain. Equal chains share one, wherever their bases are. Raises `MmpError`."""
    shapes = [[_shape(chain, int(geom), base) for geom in link.geoms] for link, base in _link_poses(chain)]
    key = _key(chain, shapes)
    name = f"arm-{key[:_SHORT]}"
    folder = cache_folder() / "scenes" / name
    if not exists(folder / "robot.json"):
        pieces = [tuple(_piece(chain, *shape) for shape in own) for own in shapes]
        write_folder(folder, files_of_pieces(chain, name, pieces, lambda line: None, COVER_OF_HULLS))
    return load_robot(str(folder))


def _link_poses(chain: Chain) -> list[tuple[Any, Float[np.ndarray, "4 4"]]]:
    return [(link, chain.base @ link.frame) for link in chain.links]


def _shape(chain: Chain, geom: int, world: Float[np.ndarray, "4 4"]) -> tuple[int, Piece | Float[np.ndarray, "v 3"]]:
    """Returns a geom and its piece, or the points of its mesh's hull, which is what MuJoCo collides."""
    return geom, geom_pieces(chain.source.model, chain.data, geom, world)


def _piece(chain: Chain, geom: int, shape: Piece | Float[np.ndarray, "v 3"]) -> Piece:
    if isinstance(shape, Piece):
        return shape
    try:
        return mesh_piece(shape)
    except MmpError as error:
        name = chain.source.model.mesh(int(chain.source.model.geom_dataid[geom])).name
        raise MmpError(f"mesh '{name}' {error}") from None


def _key(chain: Chain, shapes: list[list[tuple[int, Piece | np.ndarray]]]) -> str:
    """Returns a hash of all that the files of a robot are made from."""
    model, joints, limits = chain.source.model, list(chain.joints), limits_of(chain)
    out = hashlib.sha256(json.dumps([VERSION, mujoco.__version__, chain.source.title, chain.joint_names]).encode())

    def add(*values: Any) -> None:
        for value in values:
            array = np.round(np.asarray(value, dtype=float), _DECIMALS) + 0.0
            out.update(str(array.shape).encode() + array.tobytes())

    add(model.jnt_type[joints], chain.axes, limits.lower, limits.upper, limits.effort, limits.armature, chain.flange)
    add(sorted(chain.apart))
    for link, own in zip(chain.links, shapes, strict=True):
        out.update(link.name.encode())
        add(link.frame, link.mass, link.center, link.inertia)
        for geom, shape in own:
            out.update(bytes([int(model.geom_type[geom])]))
            if isinstance(shape, Piece):
                add(shape.vertices, shape.radius)
            else:
                add(shape)
    return out.hexdigest()
