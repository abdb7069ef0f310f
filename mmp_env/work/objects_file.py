"""Objects in files of jobs and schedules: solids with names, and where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.files.reading import Location, decode, numbers
from mmp_env.files.solid_data import ObjectData, solid_from_data, solid_to_dict
from mmp_env.model.arm import Obstacle

_POSE = ("position", "quaternion", "yaw")


def objects_from_data(data: Sequence[Any], place: Location) -> tuple[Obstacle, ...]:
    """Returns objects. Position and rotation are fields of an object, or of its `pose`. Raises `MmpError`."""
    return tuple(_object(item, place / k) for k, item in enumerate(data))


def objects_to_data(objects: Sequence[Obstacle]) -> list[dict[str, Any]]:
    """Returns the form of JSON of objects."""
    return [solid_to_dict(each) for each in objects]


def pose_from_data(data: Any, place: Location) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    """Returns the position [m] and the quaternion (wxyz) of a pose. Raises `MmpError`."""
    if not isinstance(data, dict) or set(data) != {"position", "quaternion"}:
        raise place.wrong(data, "an object with position and quaternion")
    rows = [numbers(data[key], n, place / key, "axis") for key, n in (("position", 3), ("quaternion", 4))]
    return np.array(rows[0], dtype=float), np.array(rows[1], dtype=float)


def _object(data: Any, place: Location) -> Obstacle:
    if isinstance(data, dict) and "pose" in data:
        pose = data["pose"]
        if not isinstance(pose, dict) or not set(pose) <= set(_POSE) or "position" not in pose:
            raise (place / "pose").wrong(pose, f"an object with {', '.join(_POSE[:-1])} or {_POSE[-1]}")
        if both := [key for key in _POSE if key in data]:
            raise MmpError(f"{place} has both pose and {both[0]}; give one")
        data = {key: value for key, value in data.items() if key != "pose"} | pose
    return solid_from_data(decode(data, ObjectData, place), place)
