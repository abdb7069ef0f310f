"""Views of pictures and films: from which side, and optionally from how far, the camera looks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import frozen_array

SIDES = {
    "front": (90.0, 0.0),
    "back": (-90.0, 0.0),
    "left": (0.0, 0.0),
    "right": (180.0, 0.0),
    "top": (90.0, -90.0),
}
"""Name of a view -> azimuth and elevation [deg]."""
OVERVIEW = "overview"
"""Name of the usual view, obliquely from above."""
MOST_DISTANCE_M = 40.0
"""Largest distance [m] of a camera; farther points are beyond what MuJoCo draws."""
_FIELDS = ("azimuth", "elevation", "distance", "lookat")
_ANGLE = "a finite number of degrees"
_DISTANCE = f"a number of metres above 0, {MOST_DISTANCE_M:g} at most"
_FORMS = f"{', '.join((OVERVIEW, *SIDES))}, or azimuth=DEG,elevation=DEG and perhaps distance=M,lookat=X/Y/Z"


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraView(ReadOnly):
    """A view in the angles of MuJoCo's free camera. Without a distance, the picture is filled.

    Attributes:
        azimuth: direction [deg] in which the camera looks, about the world's z axis; at 0 along x, at 90 along y.
        elevation: angle [deg] of that direction above the horizontal plane, from -90, which is straight down, to 90.
        distance: distance [m] from `lookat`. None: the whole motion fills the picture.
        lookat: the point [3] [m] in the middle of the picture. None: the middle of what the picture shows.

    Raises:
        MmpError: for numbers that are not finite or out of range, and for a `lookat` without a distance.
    """

    azimuth: float
    elevation: float
    distance: float | None = None
    lookat: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("azimuth", "elevation"):
            value = as_numbers(getattr(self, name))
            if value is None or value.ndim or not np.isfinite(value):
                raise refused(f"{name} of a camera", getattr(self, name), _ANGLE)
            object.__setattr__(self, name, float(value))
        if abs(self.elevation) > 90:
            raise refused("elevation of a camera", self.elevation, "from -90 (straight down) to 90 degrees")
        if self.distance is not None:
            metres = number("distance of a camera", self.distance, _DISTANCE)
            if metres > MOST_DISTANCE_M:
                raise refused("distance of a camera", self.distance, _DISTANCE)
            object.__setattr__(self, "distance", metres)
        if self.lookat is not None:
            point = as_numbers(self.lookat)
            if point is None or point.shape != (3,) or not np.isfinite(point).all():
                raise refused("lookat of a camera", self.lookat, "3 finite numbers [m]")
            if self.distance is None:
                raise MmpError("a camera with lookat needs a distance; without both, the motion fills the picture")
            object.__setattr__(self, "lookat", frozen_array(point))

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Axes of the camera as columns: right, up, and backward."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        level = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        upward = np.array([0.0, 0.0, 1.0])
        forward = math.cos(elevation) * level + math.sin(elevation) * upward
        up = math.cos(elevation) * upward - math.sin(elevation) * level
        return np.column_stack([np.cross(forward, up), up, -forward])


GivenView: TypeAlias = CameraView | str | None
"""A view, its name, or its numbers as text; None is the overview."""


def as_camera_view(given: GivenView) -> CameraView | None:
    """Returns the view that is given; None stands for the overview.

    Args:
        given: a view; `overview`, `front`, `back`, `left`, `right` or `top`; or text such as
            `azimuth=135,elevation=-30,distance=3,lookat=0/0/0.5`.

    Raises:
        MmpError: for anything else.
    """
    if given is None or isinstance(given, CameraView):
        return given
    if not isinstance(given, str):
        raise refused("camera", given, f"a CameraView or text: {_FORMS}")
    name = given.strip()
    if "=" in name:
        return _from_text(name)
    if name == OVERVIEW:
        return None
    if name not in SIDES:
        raise UnknownNameError("camera view", name, (OVERVIEW, *SIDES))
    azimuth, elevation = SIDES[name]
    return CameraView(azimuth=azimuth, elevation=elevation)


def _from_text(text: str) -> CameraView:
    fields: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = (word.strip() for word in part.partition("="))
        if not equals:
            raise refused("camera", text, _FORMS)
        if name not in _FIELDS:
            raise UnknownNameError("field of a camera", name, _FIELDS)
        if name in fields:
            raise MmpError(f"camera '{text}' gives {name} twice; give one")
        fields[name] = value
    for name in ("azimuth", "elevation"):
        if name not in fields:
            raise MmpError(f"camera '{text}' has no {name}; it must be {_FORMS}")
    lookat = [_number("lookat", word) for word in fields["lookat"].split("/")] if "lookat" in fields else None
    angles = {name: _number(name, fields[name]) for name in ("azimuth", "elevation")}
    distance = _number("distance", fields["distance"]) if "distance" in fields else None
    return CameraView(**angles, distance=distance, lookat=lookat)


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise MmpError(
            f"{name} of a camera is '{text}'; it must be {'X/Y/Z' if name == 'lookat' else 'a number'}"
        ) from None
