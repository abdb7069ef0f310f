"""Solids in files: obstacles, held bodies and objects of jobs (docs/reference/files.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import msgspec
import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.mesh_file import checked_pieces, read_pieces
from mmp_env.files.paths import real_path
from mmp_env.files.reading import Location, named
from mmp_env.model.arm import LARGEST_M, LARGEST_YAW_RAD, SMALLEST_M, Obstacle
from mmp_env.model.held import HELD
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.obstacle_fields import MEASURES, SHAPES
from mmp_env.model.robot import frozen_array
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.wording import degrees_hint, shown

_ALL_MEASURES = ("size", "radius", "length", "pieces", "file", "scale")


_MESH_FIELDS = ("pieces", "file", "scale")


_UNIT_ROUNDING = 1e-12
"""Largest deviation of the length of a unit quaternion from 1."""


Vector = tuple[float, float, float]


@runtime_checkable
class Posed(Protocol):
    """What has a position, and a yaw or a quaternion or neither."""

    position: Vector
    yaw: float | None
    quaternion: tuple[float, float, float, float] | None


class SolidData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    shape: str
    position: Vector
    yaw: float | None = None
    quaternion: tuple[float, float, float, float] | None = None
    size: Vector | None = None
    radius: float | None = None
    length: float | None = None
    pieces: list[list[Vector]] | None = None
    file: str | None = None
    scale: float | list[float] | None = None


class HeldData(SolidData, forbid_unknown_fields=True, kw_only=True):
    name: str = HELD


class ObstacleData(SolidData, forbid_unknown_fields=True, kw_only=True):
    name: str
    may_touch: list[str] = []
    speed: float = 0.0


class ObjectData(SolidData, forbid_unknown_fields=True, kw_only=True):
    name: str


def solid_to_dict(solid: Obstacle) -> dict[str, Any]:
    """Returns a solid as files have it. Reading it gives the same solid."""
    return (
        {
            "name": solid.name,
            "shape": solid.shape,
            "position": solid.position.tolist(),
            "quaternion": solid.quaternion.tolist(),
        }
        | {
            key: [piece.tolist() for piece in solid.pieces]
            if key == "pieces"
            else np.asarray(getattr(solid, key)).tolist()
            for key in MEASURES[solid.shape]
        }
        | ({"may_touch": sorted(solid.may_touch)} if solid.may_touch else {})
        | ({"speed": solid.speed} if solid.speed else {})
    )


def check_name(name: str, place: Location) -> None:
    """Raises `MmpError` for text that is not a name, see `NAMES`."""
    if not is_name(name):
        raise place.wrong(name, NAMES)


def solid_from_data(data: ObstacleData | HeldData | ObjectData, place: Location) -> Obstacle:
    """Returns the solid in decoded data. Raises `MmpError` for a fault, with field and value."""
    check_name(data.name, place / "name")
    if data.shape not in SHAPES:
        check_name(data.shape, place / "shape")
        raise MmpError(f"{place / 'shape'}: {UnknownNameError('shape', data.shape, SHAPES)}")
    given = {key: value for key in _ALL_MEASURES if (value := getattr(data, key)) is not None}
    wanted = MEASURES[data.shape]
    if data.shape == "mesh" and data.pieces is None:
        wanted = ("file", "scale") if data.scale is not None else ("file",)
    for key in wanted:
        if key not in given:
            raise MmpError(f"{place / key} is missing; a {data.shape} needs {' and '.join(wanted)}")
    for key, value in given.items():
        if key not in wanted:
            raise MmpError(f"{place / key} is {shown(value)}; a {data.shape} has {' and '.join(wanted)} only")
        if key not in _MESH_FIELDS and not np.all((np.asarray(value) >= SMALLEST_M) & (np.asarray(value) <= LARGEST_M)):
            raise (place / key).wrong(value, f"from {SMALLEST_M} to {LARGEST_M:g} m")
    position, quaternion = pose_from_data(data, place)
    speed = data.speed if isinstance(data, ObstacleData) else 0.0
    if not 0 <= speed < np.inf:
        raise (place / "speed").wrong(speed, "a speed [m/s], 0 or more")
    return Obstacle(
        name=data.name,
        shape=data.shape,
        position=position,
        quaternion=quaternion,
        size=frozen_array(data.size) if data.size else None,
        radius=data.radius,
        length=data.length,
        pieces=_pieces(data, place) if data.shape == "mesh" else (),
        may_touch=frozenset(data.may_touch if isinstance(data, ObstacleData) else ()),
        speed=speed,
    )


def _pieces(data: SolidData, place: Location) -> tuple[Float[np.ndarray, "_ 3"], ...]:
    """Returns the convex pieces of a mesh, those of its file unless the cell has them."""
    if data.file is None:
        return checked_pieces(data.pieces or [], place / "pieces")
    path = real_path(Path(place.file).parent / data.file)
    with named(place / "file"):
        return read_pieces(path, 1.0 if data.scale is None else data.scale)


def pose_from_data(data: Posed, place: Location) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    position = frozen_array(data.position)
    if not np.all(np.abs(position) <= LARGEST_M):
        raise (place / "position").wrong(data.position, f"three numbers from {-LARGEST_M:g} to {LARGEST_M:g} m")
    if data.quaternion is None:
        yaw = 0.0 if data.yaw is None else data.yaw
        if not np.isfinite(yaw):
            raise (place / "yaw").wrong(yaw, "a finite number [rad]")
        if abs(yaw) > LARGEST_YAW_RAD:
            raise (place / "yaw").wrong(yaw, f"from -12.566 to 12.566 rad{degrees_hint(yaw)}")
        return position, frozen_array(quaternion_from_yaw(yaw))
    if data.yaw is not None:
        raise MmpError(f"{place} has both yaw {shown(data.yaw)} and quaternion {shown(data.quaternion)}; give one")
    quaternion = frozen_array(data.quaternion)
    largest = np.max(np.abs(quaternion))
    if not (np.isfinite(quaternion).all() and largest > 0):
        raise (place / "quaternion").wrong(data.quaternion, "four finite numbers w, x, y, z that are not all zero")
    # Scaled first, which keeps tiny and huge numbers out of the squares.
    norm = largest * np.linalg.norm(quaternion / largest)
    # A unit quaternion keeps its bits, so a written cell reads back the same.
    return position, quaternion if abs(norm - 1) < _UNIT_ROUNDING else frozen_array(
        quaternion / largest / (norm / largest)
    )
