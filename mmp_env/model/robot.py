"""Robots and tools: kinematics, limits and collision spheres. `robot_reading` reads them from files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from mmp_env.brief import brief, point
from mmp_env.model.hulls import UNKNOWN_PROTRUSION_M, Hull
from mmp_env.model.read_only import ReadOnly
from mmp_env.wording import counted

SPHERE_SETS = ("28", "fine")
"""Names of the sphere sets: 28 spheres an arm, or many small ones."""
EXACT = "exact"
"""Name of the convex hulls, and of the sphere set that covers them and tells which hulls may be near."""
GEOMETRIES = (*SPHERE_SETS, EXACT)
"""Names of what may stand for the arms of a cell."""


def frozen_array(values: object, dtype: type = float) -> np.ndarray:
    """Returns a read-only copy of `values` as an array."""
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, kw_only=True, eq=False)
class Spheres(ReadOnly):
    """Spheres on links: `links` [s] (index of the link each moves with), `centers` [s, 3] [m], `radii` [s] [m]."""

    links: Int[np.ndarray, "s"]
    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, "s"]

    @brief
    def __repr__(self) -> str:
        return f"{len(self.radii)} on {counted(len(set(self.links.tolist())), 'link')}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Tool(ReadOnly):
    """A rigid tool.

    Attributes:
        name: name of the tool.
        mount: T_flange_tool, the pose of the tool frame in the flange's.
        point: the tool point in the tool frame [3] [m].
        spheres: sphere set -> spheres in the tool frame.
        self_ignore: sphere set -> names of the robot's links that may overlap with the tool.
        hulls: convex hulls in the tool frame; may be empty.
        protrusion: largest distance [m] of a point of the spheres of set `exact` from the hulls.
        mjcf: text of the MuJoCo model.
        opening: largest distance of its fingers [m], or None if tool.json does not say.
        files: file -> text of the JSON files of a tool that is not built in, which travel with plans; otherwise empty.
    """

    name: str
    mount: Float[np.ndarray, "4 4"]
    point: Float[np.ndarray, "3"]
    spheres: Mapping[str, Spheres]
    self_ignore: Mapping[str, frozenset[str]]
    mjcf: str
    hulls: tuple[Hull, ...] = ()
    protrusion: float = UNKNOWN_PROTRUSION_M
    opening: float | None = None
    files: Mapping[str, str] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        return f"{self.name}: tool point at {point(self.point)}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Robot(ReadOnly):
    """A robot model: a serial chain of hinges and slides. Link 0 is the base; joint k moves link k + 1.

    Positions of hinges are in rad, those of slides in m. Velocities, accelerations and jerks follow.

    docs/reference/robots.md gives the sources of the numbers.

    Attributes:
        name: name of the robot, such as `ur5e`.
        title: name of the product.
        joint_names: names of the joints in the vendor's description.
        link_names: names of the links, the base first.
        origins: pose of the frame of joint k in link k at q = 0 (URDF convention).
        axes: axis of joint k in its frame.
        slides: whether joint k slides along its axis, in m; otherwise it turns about it, in rad.
        lower: lower joint limits [rad or m].
        upper: upper joint limits [rad or m].
        velocity: velocity limits [rad/s or m/s].
        acceleration: acceleration limits [rad/s^2 or m/s^2].
        jerk: jerk limits [rad/s^3 or m/s^3].
        effort: torque limits of hinges [N m], force limits of slides [N].
        draw_lower: lower corner of the box of random configurations [rad]: `draw_limits` of robot.json, or the joint
            limits within +-pi.
        draw_upper: upper corner of that box [rad].
        acceleration_published: whether the vendor publishes acceleration and jerk; they are our defaults otherwise.
        flange: T_lastlink_flange, the pose of the flange in the last link.
        home: configuration of a ready arm.
        tucked: configuration of a folded arm.
        reach: horizontal reach [m].
        default_tool: name of the robot's own tool, or None.
        ring_spheres: sphere set of ring cells, `28` or, for imported robots, `exact`.
        ring_height: height [m] of the base above the table in ring and line cells; above 0 for arms that hang from it.
        spheres: sphere set -> spheres; those of link 0 cover the base.
        self_ignore: sphere set -> pairs of links (low, high) that may overlap.
        hulls: convex hulls of the links, in the order of the links; may be empty.
        protrusion: largest distance [m] of a point of the spheres of set `exact` from the hulls.
        mjcf: text of the MuJoCo model.
        files: file -> text of the JSON files of a robot that is not built in, which travel with plans; otherwise empty.
    """

    name: str
    title: str
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    origins: Float[np.ndarray, "dof 4 4"]
    axes: Float[np.ndarray, "dof 3"]
    slides: tuple[bool, ...]
    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]
    velocity: Float[np.ndarray, "dof"]
    acceleration: Float[np.ndarray, "dof"]
    jerk: Float[np.ndarray, "dof"]
    effort: Float[np.ndarray, "dof"]
    draw_lower: Float[np.ndarray, "dof"]
    draw_upper: Float[np.ndarray, "dof"]
    acceleration_published: bool
    flange: Float[np.ndarray, "4 4"]
    home: Float[np.ndarray, "dof"]
    tucked: Float[np.ndarray, "dof"]
    reach: float
    default_tool: str | None
    ring_spheres: str
    spheres: Mapping[str, Spheres]
    self_ignore: Mapping[str, frozenset[tuple[int, int]]]
    mjcf: str
    hulls: tuple[Hull, ...] = ()
    protrusion: float = UNKNOWN_PROTRUSION_M
    ring_height: float = 0.0
    files: Mapping[str, str] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        return f"{self.name}: {self.title}, {counted(self.dof, 'joint')}, reach {self.reach:g} m"

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each joint's position: `rad` of a hinge, `m` of a slide."""
        return tuple("m" if slides else "rad" for slides in self.slides)


def finest_geometry(models: Iterable[Robot | Tool]) -> str:
    """Returns `exact` if all robots and tools have hulls that their spheres are proved to cover, otherwise `fine`."""
    return EXACT if all(EXACT in model.spheres for model in models) else "fine"
