"""Arms at their base poses with their tools, and solids: obstacles and held objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, text
from mmp_env.brief import brief, point
from mmp_env.errors import MmpError
from mmp_env.model.obstacle_fields import check_fields
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import Robot, Tool, frozen_array
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.model.tool_pairs import fitted_tool
from mmp_env.model.transforms import matrix_from_quaternion, transform
from mmp_env.wording import counted

MOST_PIECES, MOST_VERTICES = 200, 1000
"""Largest numbers of the pieces of a mesh, and of the vertices of a piece."""
SMALLEST_M, LARGEST_M = 1e-6, 100.0
"""Bounds [m] of edges, radii and lengths. Positions lie within the larger one of the origin of their frame."""
LARGEST_YAW_RAD = 4 * np.pi
"""Largest yaw [rad]: two turns. Published instances have more than one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm(ReadOnly):
    """A robot in a cell. `place_arm` makes one from names.

    Attributes:
        name: unique in its cell.
        robot: the robot model.
        tool: the tool on the flange, or None.
        position: of the base frame in the world [3] [m].
        quaternion: of the base frame in the world (wxyz), of length 1.
        held: a held object, whose pose is in the frame of the tool, or of the flange without a tool; or None.
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
        """Number of joints."""
        return self.robot.dof

    @property
    def opening(self) -> float | None:
        """How far the gripper opens [m]; None if the arm has no tool, or its tool does not say."""
        return self.tool.opening if self.tool else None

    @property
    def T_world_base(self) -> Float[np.ndarray, "4 4"]:
        """Pose of the base frame in the world."""
        return transform(matrix_from_quaternion(self.quaternion), self.position)


@dataclass(frozen=True, kw_only=True, eq=False)
class Obstacle(ReadOnly):
    """A solid that stands still in a cell, moves with a bounded speed, or is held by an arm.

    Attributes:
        name: unique among the obstacles of a cell.
        shape: `box`, `sphere`, `cylinder`, `capsule` or `mesh`.
        position: of its centre [3] [m]; of a mesh, of the origin of its vertices.
        quaternion: of its frame (wxyz); cylinders and capsules lie along z.
        size: full edge lengths [3] [m] of a box, otherwise None.
        radius: of the other shapes [m].
        length: of a cylinder, or of a capsule without its caps [m].
        pieces: vertices [v, 3] [m] of the convex hulls that a mesh consists of, in its frame; empty otherwise.
        may_touch: moving links, tools and held objects, such as `arm0/shoulder` and `arm0/held`, that no query tests
            against an obstacle of a cell.
        speed: largest speed [m/s] of any of its points from the time 0 on, when it is where it says; it may move
            anywhere. 0 for a solid that stands still, and for a held one.

    Raises:
        MmpError: for an unknown shape, fields that are missing or belong to other shapes, and values of another form.
    """

    name: str
    shape: str
    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    size: Float[np.ndarray, "3"] | None = None
    radius: float | None = None
    length: float | None = None
    pieces: tuple[Float[np.ndarray, "_ 3"], ...] = ()
    may_touch: frozenset[str] = frozenset()
    speed: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "quaternion", "size"):  # lists will do
            numbers = as_numbers(getattr(self, name))
            if isinstance(getattr(self, name), list | tuple) and numbers is not None:
                object.__setattr__(self, name, numbers)
        check_fields(vars(self))
        object.__setattr__(self, "may_touch", frozenset(self.may_touch))
        super().__post_init__()

    @brief
    def __repr__(self) -> str:
        edges = [] if self.size is None else [" x ".join(f"{edge:g}" for edge in self.size) + " m"]
        edges += [f"{counted(len(self.pieces), 'convex piece')}"] if self.pieces else []
        named = {"radius": self.radius, "length": self.length}
        measures = edges + [f"{name} {value:g} m" for name, value in named.items() if value is not None]
        return f"{self.name}: {self.shape}, {', '.join(measures)}, at {point(self.position)}"

    @cached_property
    def pose(self) -> Float[np.ndarray, "4 4"]:
        """Pose of its frame."""
        return frozen_array(transform(matrix_from_quaternion(self.quaternion), self.position))

    @property
    def half_size(self) -> Float[np.ndarray, "3"]:
        """MuJoCo's size [m]: half edges of a box; otherwise radius, half length without caps, and 0."""
        if self.size is not None:
            return self.size / 2
        return np.array([self.radius or 0.0, (self.length or 0.0) / 2, 0.0])

    @property
    def half_extents(self) -> Float[np.ndarray, "3"]:
        """Half edges [m] of the bounding box in its own frame."""
        if self.size is not None:
            return self.size / 2
        if self.pieces:
            return np.ptp(np.concatenate(self.pieces), axis=0) / 2
        radius, straight, _ = self.half_size
        return np.array([radius, radius, straight + (0.0 if self.shape == "cylinder" else radius)])

    @property
    def middle(self) -> Float[np.ndarray, "3"]:
        """Centre [m] of the bounding box in its own frame, which is the origin unless the solid is a mesh."""
        if not self.pieces:
            return np.zeros(3)
        points = np.concatenate(self.pieces)
        return (points.min(axis=0) + points.max(axis=0)) / 2


def place_arm(name: str, robot: str, position: ArrayLike, quaternion: ArrayLike, tool: str | None = "default") -> Arm:
    """Makes an arm from the names of a robot and a tool.

    Args:
        name: name of the arm in its cell.
        robot: name of the robot, see `robot_names`.
        position: of the base frame in the world [3] [m].
        quaternion: of the base frame in the world [4] (wxyz), of any length above 0.
        tool: name of the tool, see `tool_names`; `"default"` for the robot's own; None for a bare flange.

    Returns:
        The arm, which holds nothing.

    Raises:
        UnknownNameError: for an unknown robot or tool.
        MmpError: for a name that is not text, a position or quaternion that is not finite numbers, or a zero
            quaternion.
    """
    text("name", name)
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
        tool=fitted_tool(load_tool(tool_name), model) if tool_name not in (None, "") else None,
        position=place,
        quaternion=frozen_array(turn / np.linalg.norm(turn)),
    )
