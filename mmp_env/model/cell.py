"""A cell: arms at their base poses, their tools, and static obstacles."""

from __future__ import annotations

import reprlib
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, given
from mmp_env.brief import brief, point, some
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import SPHERE_SETS, Robot, Tool, frozen_array, load_robot, load_tool
from mmp_env.model.transforms import matrix_from_quaternion, transform
from mmp_env.wording import counted

if TYPE_CHECKING:
    from mmp_env.model.collision import CollisionModel

SHAPES = ("box", "sphere", "cylinder", "capsule")
NAMES = "1 to 100 printable characters without '/'"
"""What may be a name: it stands in paths such as `<cell>/<instance>` and `<arm>/joint1`, and in files."""
_LONGEST_NAME = 100


def is_name(text: str) -> bool:
    """Returns whether a cell, an arm, an obstacle or an instance may have this name, see `NAMES`."""
    return 0 < len(text) <= _LONGEST_NAME and text.isprintable() and "/" not in text


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """Arms and obstacles; `spheres` names the sphere set, `28` or `fine`, that stands for the arms in every query."""

    name: str
    arms: tuple[Arm, ...]
    obstacles: tuple[Obstacle, ...] = ()
    spheres: str = "28"

    def __post_init__(self) -> None:
        if self.spheres not in SPHERE_SETS:
            raise UnknownNameError("sphere set", self.spheres, SPHERE_SETS)
        for name in (self.name, *self.arm_names, *(obstacle.name for obstacle in self.obstacles)):
            if not is_name(name):
                raise MmpError(f"a cell, or something in it, is named {reprlib.repr(name)}; a name must be {NAMES}")
        if not self.arms:
            raise MmpError(f"cell '{self.name}' has no arms; it needs at least one")
        for kind, names in (("arms", self.arm_names), ("obstacles", [o.name for o in self.obstacles])):
            twice = sorted({name for name in names if list(names).count(name) > 1})
            if twice:
                raise MmpError(f"cell '{self.name}' has two {kind} named '{twice[0]}'; names must differ")
        if "obstacle" in self.arm_names:  # their geoms are called obstacle/NAME, an arm's ARM/NAME
            raise MmpError(f"cell '{self.name}' has an arm named 'obstacle'; that name is kept for obstacles")

    @property
    def arm_names(self) -> tuple[str, ...]:
        return tuple(arm.name for arm in self.arms)

    def arm(self, name: str) -> Arm:
        """The arm of that name. Raises `UnknownNameError`."""
        return self.arms[self.arm_index(name)]

    def arm_index(self, name: str) -> int:
        """Place of the arm of that name in `arms`. Raises `UnknownNameError`."""
        if name not in self.arm_names:
            raise UnknownNameError("arm", name, self.arm_names)
        return self.arm_names.index(name)

    @brief
    def __repr__(self) -> str:
        robots = Counter(arm.robot.name for arm in self.arms)
        arms = ", ".join(f"{count} {robot}" for robot, count in robots.items())
        names = [obstacle.name for obstacle in self.obstacles]
        obstacles = f"{counted(len(names), 'obstacle')} ({some(names)})" if names else "no obstacles"
        return f"{self.name}: {counted(len(self.arms), 'arm')} ({arms}), {obstacles}, sphere set {self.spheres}"

    def __getstate__(self) -> dict[str, object]:
        # What is copied or sent to another process is the data; the compiled queries are built there anew.
        return {key: value for key, value in vars(self).items() if key != "collision"}

    @cached_property
    def collision(self) -> CollisionModel:
        """The collision queries of this cell, built on first use."""
        from mmp_env.model.collision import CollisionModel

        return CollisionModel(self)


def given_cell(cell: object) -> Cell:
    """Returns the cell. Raises `MmpError` for anything else, such as the name of a cell."""
    hint = "; find_cell gives the one of a name or file" if isinstance(cell, str | PathLike) else ""
    return given("cell", cell, Cell, f"a Cell{hint}")


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
