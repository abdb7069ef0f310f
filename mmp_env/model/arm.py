"""Arms at their base poses with their tools, and the solids that stand beside them or are held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers
from mmp_env.brief import brief, point
from mmp_env.errors import MmpError
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import Robot, Tool, frozen_array, load_robot, load_tool
from mmp_env.model.transforms import matrix_from_quaternion, transform

SHAPES = ("box", "sphere", "cylinder", "capsule")
SMALLEST_M, LARGEST_M = 1e-6, 100.0
"""Bounds [m] of edges, radii and lengths. Positions lie within the larger one of the origin of their frame."""
LARGEST_YAW_RAD = 2 * np.pi + 1e-4
"""Largest yaw [rad]: a full turn, with room for rounding. A larger number is probably in degrees."""
NAMES = "1 to 100 printable characters without '/'"
"""What may be a name: it stands in paths such as `<cell>/<instance>` and `<arm>/joint1`, and in files."""
_LONGEST_NAME, _LONGEST_INSTANCE_NAME = 100, 250


def is_name(text: str) -> bool:
    """Returns whether a cell, an arm, an obstacle or an instance may have this name, see `NAMES`."""
    return 0 < len(text) <= _LONGEST_NAME and text.isprintable() and "/" not in text


INSTANCE_NAMES = f"names joined by '/', each {NAMES}; {_LONGEST_INSTANCE_NAME} characters at most"
"""What may be the name of a problem, such as `<cell>/<instance>`."""


def is_instance_name(text: str) -> bool:
    """Returns whether a problem may have this name, see `INSTANCE_NAMES`; it may also have none."""
    return not text or (len(text) <= _LONGEST_INSTANCE_NAME and all(map(is_name, text.split("/"))))


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm(ReadOnly):
    """A robot at its place: `position` [m] and `quaternion` (wxyz) of its base frame in the world.

    What it holds, if anything, is a solid whose pose is in the frame of the tool, or of the flange where it has none.
    """

    name: str
    robot: Robot
    tool: Tool | None
    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    held: Obstacle | None = None

    @brief
    def __repr__(self) -> str:
        robot = self.robot.name + (f" with {self.tool.name}" if self.tool else "")
        holds = f", holds a {self.held.shape}" if self.held else ""
        turned = ", ".join(f"{x:.4g}" for x in self.quaternion)
        return f"{self.name}: {robot} at {point(self.position)}, quaternion [{turned}]{holds}"

    @property
    def dof(self) -> int:
        return self.robot.dof

    @property
    def T_world_base(self) -> Float[np.ndarray, "4 4"]:
        return transform(matrix_from_quaternion(self.quaternion), self.position)


@dataclass(frozen=True, kw_only=True, eq=False)
class Obstacle(ReadOnly):
    """A solid that stands still, or is held by an arm.

    `size` [3] are full edge lengths [m] of a box; `radius`, `length` (without caps) [m] of others.
    """

    name: str
    shape: str
    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    size: Float[np.ndarray, "3"] | None = None
    radius: float | None = None
    length: float | None = None

    @brief
    def __repr__(self) -> str:
        edges = [] if self.size is None else [" x ".join(f"{edge:g}" for edge in self.size) + " m"]
        named = {"radius": self.radius, "length": self.length}
        measures = edges + [f"{name} {value:g} m" for name, value in named.items() if value is not None]
        return f"{self.name}: {self.shape}, {', '.join(measures)}, at {point(self.position)}"

    @property
    def half_size(self) -> Float[np.ndarray, "3"]:
        """As MuJoCo has it [m]: half edges of a box; of others radius, half length without caps, and 0."""
        if self.size is not None:
            return self.size / 2
        return np.array([self.radius or 0.0, (self.length or 0.0) / 2, 0.0])

    @property
    def half_extents(self) -> Float[np.ndarray, "3"]:
        """Half edges [m] of the box around it that is turned as it is."""
        if self.size is not None:
            return self.size / 2
        radius, straight, _ = self.half_size
        return np.array([radius, radius, straight + (0.0 if self.shape == "cylinder" else radius)])


def place_arm(name: str, robot: str, position: ArrayLike, quaternion: ArrayLike, tool: str | None = "default") -> Arm:
    """An arm from names; `tool="default"` takes the robot's own, None leaves the flange bare.

    `position` [3] [m] and `quaternion` [4] (wxyz, of any length) are those of its base. Raises `UnknownNameError`, and
    `MmpError` for a pose that is none.
    """
    model = load_robot(robot)
    tool_name = model.default_tool if tool == "default" else tool
    place, turn = (frozen_array(np.nan if q is None else q) for q in (as_numbers(position), as_numbers(quaternion)))
    if (place.shape, turn.shape) != ((3,), (4,)) or not np.isfinite([*place, *turn]).all() or not turn.any():
        raise MmpError(
            f"arm '{name}' stands at {place.tolist()}, turned by {turn.tolist()}; it needs three finite numbers [m],"
            " and four that are not all zero (wxyz)"
        )
    return Arm(
        name=name,
        robot=model,
        tool=load_tool(tool_name) if tool_name else None,
        position=place,
        quaternion=frozen_array(turn / np.linalg.norm(turn)),
    )
