"""A cell: arms at their base poses, their tools, and static obstacles."""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import given, text
from mmp_env.brief import brief, some
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.collision import CollisionModel
from mmp_env.model.joint_chain import part_names
from mmp_env.model.keep import Upright, as_keep
from mmp_env.model.model_joints import ModelJoints
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.read_only import read_only
from mmp_env.model.robot import EXACT, GEOMETRIES, frozen_array
from mmp_env.wording import counted

MOST_ARMS = 256
"""Largest number of arms of a cell that a name or a file makes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """Arms and obstacles.

    Attributes:
        name: name of the cell.
        arms: at least one.
        obstacles: solids that stand still; or that move, for what `OnlinePlanner` commits.
        spheres: name of the sphere set of all queries: `28` (28 spheres an arm), `fine`, or `exact` (convex hulls
            decide where spheres come close).
        joints: the joints in the MuJoCo model that `cell_from_mujoco` made the cell from; otherwise None.
        keep: arm name -> bound of its tool axis, which all collision queries of that arm keep. It belongs to a problem:
            cell files do not have it.

    Raises:
        UnknownNameError: for an unknown sphere set.
        MmpError: for a bad or repeated name, a cell without arms, or arms and obstacles of another kind.
    """

    name: str
    arms: tuple[Arm, ...]
    obstacles: tuple[Obstacle, ...] = ()
    spheres: str = "28"
    joints: ModelJoints | None = None
    keep: Mapping[str, Upright] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.spheres not in GEOMETRIES:
            raise UnknownNameError("sphere set", text("spheres", self.spheres), GEOMETRIES)
        for attribute, kind in (("arms", Arm), ("obstacles", Obstacle)):
            for each in given(attribute, getattr(self, attribute), Sequence, "a tuple or list"):
                given(f"one of the {attribute}", each, kind, f"an {kind.__name__}")
            object.__setattr__(self, attribute, tuple(getattr(self, attribute)))
        for name in (self.name, *self.arm_names, *(obstacle.name for obstacle in self.obstacles)):
            if not is_name(name):
                raise MmpError(f"a cell, or something in it, is named {reprlib.repr(name)}; a name must be {NAMES}")
        _require_geometry(self)
        if not self.arms:
            raise MmpError(f"cell '{self.name}' has no arms; it needs at least one")
        for kind, names in (("arms", self.arm_names), ("obstacles", [o.name for o in self.obstacles])):
            twice = sorted({name for name in names if list(names).count(name) > 1})
            if twice:
                raise MmpError(f"cell '{self.name}' has two {kind} named '{twice[0]}'; names must differ")
        object.__setattr__(self, "keep", read_only(as_keep(self.keep, self.arm_names)))
        moving = {f"{arm.name}/{part}" for arm in self.arms for part in part_names(arm)[1:]}
        for obstacle in self.obstacles:
            if obstacle.speed and obstacle.pieces:
                raise MmpError(f"obstacle '{obstacle.name}' is a mesh; only one of another shape can move")
            if strange := sorted(obstacle.may_touch - moving):
                raise UnknownNameError(f"moving part in may_touch of obstacle '{obstacle.name}':", strange[0], moving)
        if "obstacle" in self.arm_names:  # their geoms are called obstacle/NAME, an arm's ARM/NAME
            raise MmpError(f"cell '{self.name}' has an arm named 'obstacle'; that name is kept for obstacles")

    @property
    def arm_names(self) -> tuple[str, ...]:
        """Names of the arms, in their order."""
        return self._arm_names

    @cached_property
    def _arm_names(self) -> tuple[str, ...]:
        return tuple(arm.name for arm in self.arms)

    @cached_property
    def joint_limits(self) -> tuple[Float[np.ndarray, "all_dof"], Float[np.ndarray, "all_dof"]]:
        """Lower and upper limits of the joints of all arms [rad, of slides m], in the order of the arms."""
        lower = np.concatenate([arm.robot.lower for arm in self.arms])
        return frozen_array(lower), frozen_array(np.concatenate([arm.robot.upper for arm in self.arms]))

    @property
    def largest_unit(self) -> str:
        """Unit of the largest of some distances, one of each joint: `rad`, `m` or `rad or m`."""
        slides = [slides for arm in self.arms for slides in arm.robot.slides]
        return "m" if all(slides) else "rad or m" if any(slides) else "rad"

    def arm(self, name: str) -> Arm:
        """Returns the arm of that name. Raises `UnknownNameError`."""
        return self.arms[self.arm_index(name)]

    def arm_index(self, name: str) -> int:
        """Returns the index of the arm of that name in `arms`. Raises `UnknownNameError`."""
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
        # A copy, or a cell in another process, builds its compiled queries itself.
        return {key: value for key, value in vars(self).items() if key not in ("collision", "_alone", "joint_limits")}

    @cached_property
    def collision(self) -> CollisionModel:
        """The collision queries of this cell, compiled at first use."""
        return CollisionModel(self)

    def alone(self, name: str) -> Cell:
        """Returns the cell with one arm only, which later calls return again.

        Obstacles may touch the parts of that arm.
        """
        if name not in self._alone:
            obstacles = tuple(_touched_by(name, each) if each.may_touch else each for each in self.obstacles)
            keep = {arm: bound for arm, bound in self.keep.items() if arm == name}
            self._alone[name] = replace(self, arms=(self.arm(name),), obstacles=obstacles, joints=None, keep=keep)
        return self._alone[name]

    @cached_property
    def _alone(self) -> dict[str, Cell]:
        return {}


def _touched_by(name: str, obstacle: Obstacle) -> Obstacle:
    """Returns the obstacle with the parts in `may_touch` that belong to one arm."""
    return replace(obstacle, may_touch=frozenset(part for part in obstacle.may_touch if part.startswith(f"{name}/")))


def given_cell(cell: object) -> Cell:
    """Returns the cell. Raises `MmpError` for anything else, such as the name of a cell."""
    hint = "; find_cell gives the one of a name or file" if isinstance(cell, str | PathLike) else ""
    return given("cell", cell, Cell, f"a Cell{hint}")


def _require_geometry(cell: Cell) -> None:
    """Raises `MmpError` where a robot or tool of a cell lacks the cell's sphere set."""
    for arm in cell.arms:
        for kind, body in (("robot", arm.robot), ("tool", arm.tool)):
            if body is None or cell.spheres in body.spheres:
                continue
            lack = "hulls that its spheres are proved to cover" if cell.spheres == EXACT else "such spheres"
            raise MmpError(
                f"cell '{cell.name}': {kind} '{body.name}' of arm '{arm.name}' has no {lack}, so the cell cannot have"
                f" the sphere set '{cell.spheres}'; use '{'fine' if cell.spheres == EXACT else EXACT}'"
            )
