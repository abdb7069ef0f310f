"""A plan as the checker reads it: arms, solids, cell and plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.check.asked import Asked
from mmp_env.check.keep import CheckedUpright
from mmp_env.check.models import CheckedModel


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedArm:
    """An arm of the file, its robot and tool. `position` [m] and `quaternion` (wxyz) are its base.

    The pose of the `held` object is in the tool's frame, or in the flange's without a tool.
    """

    name: str
    robot: CheckedModel
    tool: CheckedModel | None
    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    held: Solid | None = None

    @property
    def dof(self) -> int:
        return len(self.robot.data["joints"])


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """An obstacle, a piece of one, or a held object.

    `size` [m] follows MuJoCo: half edges, or radius and half length without caps. A `mesh` is piece number `piece` of
    its obstacle: the hull of `vertices` [v, 3] [m] in its frame.

    `may_touch` names moving links, such as `arm0/shoulder`, that may touch an obstacle. No point of it moves faster
    than `speed` [m/s] from the time 0 on.
    """

    name: str
    shape: str
    size: Float[np.ndarray, "3"]
    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"]
    piece: int | None = None
    vertices: Float[np.ndarray, "v 3"] | None = None
    may_touch: frozenset[str] = frozenset()
    speed: float = 0.0

    @property
    def geom(self) -> str:
        """Name of its geom in MuJoCo."""
        return f"obstacle/{self.name}" + ("" if self.piece is None else f"/{self.piece}")


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedCell:
    """Arms, obstacles and the sphere set (`28`, `fine` or `exact`) that stands for the arms."""

    arms: tuple[CheckedArm, ...]
    solids: tuple[Solid, ...]
    spheres: str

    @property
    def slides(self) -> Bool[np.ndarray, "n"]:
        """Which joints slide, in m, according to robot.json. The others turn, in rad."""
        return np.array([joint.get("type") == "slide" for arm in self.arms for joint in arm.robot.data["joints"]])

    @property
    def columns(self) -> tuple[slice, ...]:
        """The joints of each arm among the joints of all arms."""
        ends = np.cumsum([arm.dof for arm in self.arms]).tolist()
        return tuple(slice(end - arm.dof, end) for arm, end in zip(self.arms, ends, strict=True))

    @property
    def may_touch(self) -> tuple[tuple[str, str], ...]:
        """Moving links and obstacles that may touch: no check tests these pairs."""
        pairs = [(link, solid.name) for solid in self.solids for link in sorted(solid.may_touch)]
        return tuple(dict.fromkeys(pairs))  # the pieces of a mesh share the name of their obstacle

    def of_robots(self, key: str) -> Float[np.ndarray, "n"]:
        """Returns a property of all joints from robot.json."""
        return np.array([joint[key] for arm in self.arms for joint in arm.robot.data["joints"]], dtype=float)


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedPlan:
    """The content of a plan.json. Joint data are [n] or [t, n]: the joints of all arms side by side, in order.

    `margins`: kind -> clearance [m] that the plan keeps at every instant; `margin` [m] is that of the file. `asked`:
    arm name -> what was asked for; `keep`: arm name -> bound of its tool axis. Fields that only retimed plans have are
    None otherwise.
    """

    cell: CheckedCell
    margin: float
    margins: Mapping[str, float]
    times: Float[np.ndarray, "t"]
    positions: Float[np.ndarray, "t n"]
    start: Float[np.ndarray, "n"]
    goal: Float[np.ndarray, "n"]
    max_velocity: Float[np.ndarray, "n"]
    asked: Mapping[str, Asked] = field(default_factory=dict)
    max_acceleration: Float[np.ndarray, "n"] | None = None
    max_jerk: Float[np.ndarray, "n"] | None = None
    velocities: Float[np.ndarray, "t n"] | None = None
    accelerations: Float[np.ndarray, "t n"] | None = None
    keep: Mapping[str, CheckedUpright] = field(default_factory=dict)

    @property
    def joints(self) -> list[tuple[str, int]]:
        """Arm and joint (from 1) of each column."""
        return [(arm.name, k + 1) for arm in self.cell.arms for k in range(arm.dof)]

    @property
    def units(self) -> list[str]:
        """Unit of each column: `rad` of a hinge, `m` of a slide."""
        return ["m" if slides else "rad" for slides in self.cell.slides]

    def of_robots(self, key: str) -> Float[np.ndarray, "n"]:
        """Returns a property of all joints from robot.json."""
        return self.cell.of_robots(key)
