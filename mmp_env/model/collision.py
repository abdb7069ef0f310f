"""Collision queries of a cell, batched: float64 arrays in and out, computed by the native core.

Distances are between sphere surfaces, and negative in contact. The single-precision kernels agree with exact arithmetic
to 1e-5 m within 40 m of the origin. `precise=True` computes in double precision, with the same bits on every processor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from mmp_env import core
from mmp_env.argument_checks import as_numbers, given, number, refused
from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.conflict import Conflict, TimedPlan, plan_conflicts
from mmp_env.model.convex_hull import supporting_planes
from mmp_env.model.joint_chain import exact_hulls, joint_chain, part_names
from mmp_env.model.keep import Upright
from mmp_env.model.margins import DEFAULT_MARGIN_M, KINDS, Margins, queried_margins
from mmp_env.model.obstacle_fields import SHAPES
from mmp_env.model.robot import EXACT
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.wording import counted, shown

SEARCH_MARGIN_FACTOR = 1.0
"""Share of the planning slack that a search adds to the margin at the tested instants."""
PLAN_MARGIN_FACTOR = 0.5
"""Share of the planning slack that single-arm planning proves beyond the margin at every instant."""
KEEP_MARGIN_FACTOR = 0.2
"""Share that motions are proved to keep between the tested instants: between arms, and after repulsion."""
REQUIRED_MARGIN_FACTOR = 0.0
"""Share that a certificate proves: the margin itself. The gaps between these shares let each later proof end."""


def levels_of(margins: Margins, looked: float, proved: float) -> core.Levels:
    """Returns the clearances for the core: the margins plus `looked` and `proved` [m].

    Bounds of tool axes have no margin: `looked` and `proved` are distances of the point at 1 m on the axis.
    """
    arms = margins.arms
    return core.Levels(arms + looked, arms + proved, margins.obstacles - arms, margins.self - arms, -arms)


LARGEST_POSITION = 1e4
"""Largest absolute position of a joint [rad, of a slide m]. The native core takes no larger one."""
_LARGEST_STRAY = 1e6
"""Largest distance of an arm from its lines [rad, of slides m]. The native core takes no larger one."""
_EDGE_ROOM_M = 1e-4
"""Clearance [m] beyond the margin at the instants that `edge_free` tests."""


class Nearest(NamedTuple):
    """The nearest bodies of a state, in words, and their clearance [m]."""

    bodies: str
    clearance_m: float


@runtime_checkable
class ArmsAndObstacles(Protocol):
    """The part of a cell that collision queries use."""

    @property
    def name(self) -> str: ...
    @property
    def arms(self) -> tuple[Arm, ...]: ...
    @property
    def obstacles(self) -> tuple[Obstacle, ...]: ...
    @property
    def spheres(self) -> str: ...
    @property
    def arm_names(self) -> tuple[str, ...]: ...
    @property
    def keep(self) -> Mapping[str, Upright]: ...
    def arm(self, name: str) -> Arm: ...
    def arm_index(self, name: str) -> int: ...


class CollisionModel:
    """The collision queries of a cell, `Cell.collision`. `core` is the compiled cell.

    Configurations `q` are [n, dof] [rad], clearances [m]. Unknown arms raise `UnknownNameError`, wrong shapes and
    numbers that are not finite raise `MmpError`.
    """

    def __init__(self, cell: ArmsAndObstacles) -> None:
        self.cell = cell
        self._numbers = {arm.name: k for k, arm in enumerate(cell.arms)}
        self.core = core.Cell()
        for arm in cell.arms:
            self.core.add_arm(**joint_chain(arm, cell.spheres))
            for hull in exact_hulls(arm) if cell.spheres == EXACT else ():
                self.core.add_hull(arm=self._numbers[arm.name], **hull)
        for name, bound in cell.keep.items():
            core.keep_upright(self.core, self._numbers[name], bound.direction, bound.within)
        self._solids: list[str] = []
        for obstacle in cell.obstacles:
            pieces = self._add(obstacle)
            self._let_touch(obstacle, range(len(self._solids), len(self._solids) + pieces))
            self._solids += [obstacle.name] * pieces
        self.core.freeze()
        self._radii = [core.sphere_table(self.core, k)[:, 1] for k in range(len(cell.arms))]
        self._links = [core.sphere_table(self.core, k)[:, 0].astype(int) for k in range(len(cell.arms))]

    def _add(self, obstacle: Obstacle) -> int:
        """Adds an obstacle to the core. Returns the number of bodies there, one for each piece of a mesh."""
        if obstacle.pieces:
            turn = matrix_from_quaternion(obstacle.quaternion)
            for piece in obstacle.pieces:
                placed = np.array([turn @ vertex + obstacle.position for vertex in piece])
                self.core.add_hull_obstacle(vertices=placed, planes=supporting_planes(placed))
            return len(obstacle.pieces)
        self.core.add_obstacle(SHAPES.index(obstacle.shape), *_pose_and_size(obstacle))
        return 1

    def _let_touch(self, obstacle: Obstacle, pieces: range) -> None:
        """Lets parts of arms touch an obstacle, whose pieces have these numbers in the core."""
        for name in sorted(obstacle.may_touch):
            arm, _, part = name.partition("/")
            number = self._numbers[arm]
            index = part_names(self.cell.arms[number]).index(part)
            for piece in pieces:
                self.core.let_touch(obstacle=piece, arm=number, link=index)

    def __reduce__(self) -> tuple[Any, ...]:
        # The compiled core cannot be pickled; the cell can, and compiles its queries again.
        return attrgetter("collision"), (self.cell,)

    @brief
    def __repr__(self) -> str:
        spheres = f"{sum(map(len, self._radii))} spheres of set {self.cell.spheres}"
        sizes = f"{counted(len(self.cell.arms), 'arm')}, {counted(len(self.cell.obstacles), 'obstacle')}"
        return f"of cell {self.cell.name}: {sizes}, {spheres}"

    def index(self, arm: str) -> int:
        """Returns the number of an arm in the core. Raises `UnknownNameError`."""
        index = self._numbers.get(given("arm", arm, str, "the name of an arm"))
        return self.cell.arm_index(arm) if index is None else index

    def spheres(self, arm: str, q: ArrayLike) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "s"]]:
        """Returns sphere centres [n, s, 3] [m] in the world and radii [s] [m] of an arm, those of the base first."""
        return core.spheres(self.core, self.index(arm), self._rows(arm, q)), self._radii[self.index(arm)].copy()

    def sphere_links(self, arm: str) -> list[str]:
        """Returns the name of the link of each sphere of `spheres`; the tool's name, or `held` for a held object."""
        names = part_names(self.cell.arms[self.index(arm)])
        return [names[k] for k in self._links[self.index(arm)]]

    def is_base(self, arm: str) -> Bool[np.ndarray, "s"]:
        """Returns which spheres of `spheres` belong to the base, which stands still."""
        return self._links[self.index(arm)] == 0

    def tool_points(self, arm: str, q: ArrayLike) -> Float[np.ndarray, "n 3"]:
        """Returns the tool points [n, 3] [m] in the world; the origin of the flange without a tool."""
        return core.tool_points(self.core, self.index(arm), self._rows(arm, q))

    def within_limits(self, arm: str, q: ArrayLike) -> Bool[np.ndarray, "n"]:
        """Returns whether each configuration is within the joint limits."""
        rows, robot = self._finite_rows(arm, q), self.cell.arms[self.index(arm)].robot
        return np.all((rows >= robot.lower) & (rows <= robot.upper), axis=1)

    def static_clearance(self, arm: str, q: ArrayLike, *, precise: bool = False) -> Float[np.ndarray, "n"]:
        """Returns the clearances [n] [m] of an arm from obstacles, the other arms' bases and itself."""
        return core.static_clearance(self.core, self.index(arm), self._rows(arm, q), precise=precise)

    def is_free(self, arm: str, q: ArrayLike, *, margin: float = 0.0) -> Bool[np.ndarray, "n"]:
        """Returns whether each configuration is free.

        It is within limits, its `static_clearance` is above `margin` [m], and it keeps the bound of the tool axis.
        """
        least = queried_margins(margin).obstacles
        free = self.within_limits(arm, q) & (self.static_clearance(arm, q) > least)
        return free & (self.tilt(arm, q) < self.cell.keep[arm].within) if arm in self.cell.keep else free

    def edge_free(
        self, arm: str, q_from: ArrayLike, q_to: ArrayLike, *, margin: float | Margins = DEFAULT_MARGIN_M
    ) -> Bool[np.ndarray, "n"]:
        """Returns whether straight segments from `q_from` to `q_to` [n, dof] are free at every instant.

        A free segment is within joint limits, and proved to keep the margin at every instant from obstacles, the bases
        of other arms and the arm itself, and the bound of its tool axis. A segment that comes within 0.1 mm of its
        margin, or 0.0001 rad of its bound, may count as not free, because its proof might not end.

        Args:
            margin: one margin [m] for all bodies, or `problem.margins`.
        """
        start, end = self._finite_rows(arm, q_from), self._finite_rows(arm, q_to)
        if start.shape != end.shape:
            raise MmpError(f"edge_free: q_from has {len(start)} rows and q_to {len(end)}; they must match")
        free = self.within_limits(arm, start) & self.within_limits(arm, end)
        margins = queried_margins(margin)
        room = min(_EDGE_ROOM_M, min(margins[kind] for kind in KINDS) / 4)
        wanted = levels_of(margins, room, room / 2)
        free[free] = core.edges_free(self.core, self.index(arm), start[free], end[free], wanted)
        return free

    def tilt(self, arm: str, q: ArrayLike) -> Float[np.ndarray, "n"]:
        """Returns the angles [n] [rad] between the tool axis that `arm` keeps upright and the world's z axis.

        Raises `MmpError` for an arm that keeps no axis upright.
        """
        index = self.index(arm)
        if arm not in self.cell.keep:
            raise MmpError(f"arm '{arm}' has no bound on the angle of its tool; make_problem(..., keep=...) gives one")
        x, y, z = core.tool_axes(self.core, index, self._rows(arm, q)).T
        return np.arctan2(np.hypot(x, y), z)

    def project_upright(self, arm: str, q: ArrayLike) -> tuple[Float[np.ndarray, "n dof"], Bool[np.ndarray, "n"]]:
        """Returns `q` [n, dof], moved where needed so that the arm keeps the bound of its tool axis, and where it does.

        The result is within the joint limits. It may be in collision. Raises `MmpError` like `tilt`.
        """
        self.tilt(arm, q)
        return core.project_upright(self.core, self.index(arm), self._rows(arm, q))

    def pair_clearance(
        self, arm_a: str, q_a: ArrayLike, arm_b: str, q_b: ArrayLike, *, precise: bool = False
    ) -> Float[np.ndarray, "n"]:
        """Returns the clearances [n] [m] between two arms at `q_a`, `q_b` [n, dof], with their bases."""
        a, b = self._rows(arm_a, q_a), self._rows(arm_b, q_b)
        if len(a) != len(b) or arm_a == arm_b:
            raise MmpError(f"pair_clearance: {len(a)} rows of {arm_a} and {len(b)} of {arm_b}; two arms, equal rows")
        return core.pair_clearance(self.core, self.index(arm_a), a, self.index(arm_b), b, precise=precise)

    def swept_clearance(self, arm: str, q: ArrayLike, body: Obstacle, *, stray: float = 0.0) -> Float[np.ndarray, "s"]:
        """Returns lower bounds [n - 1] [m] of the clearance of an arm from a body along lines between configurations.

        The bounds hold at every instant of the straight lines between the rows of `q` [n, dof], for all parts that
        move. The body is none of the cell's obstacles.

        Args:
            arm: name of the arm.
            q: configurations [n, dof] [rad], at least two.
            body: any solid but a mesh.
            stray: how far the arm may be from the lines, in every joint [rad, of slides m].

        Raises:
            MmpError: for a mesh, for rows of the wrong shape, and for a `stray` below 0 or above 1e6.
        """
        rows = self._rows(arm, q)
        if given("body", body, Obstacle, "an Obstacle").pieces or len(rows) < 2:
            raise MmpError("swept_clearance: takes two configurations or more, and any body but a mesh")
        allowed = f"a number from 0 to {_LARGEST_STRAY:g}"
        if number("stray", stray, allowed, zero=True) > _LARGEST_STRAY:
            raise refused("stray", stray, allowed)
        shape = SHAPES.index(body.shape)
        return core.swept_clearance(self.core, self.index(arm), rows, shape, *_pose_and_size(body), stray=stray)

    def clearance(self, q: Mapping[str, ArrayLike]) -> Float[np.ndarray, "n"]:
        """Returns the least clearances [n] [m] of whole states over pairs of arms, and of arms and obstacles.

        Args:
            q: arm name -> [n, dof] [rad].
        """
        self._require_arms(q)
        rows = [self._rows(name, q[name]) for name in self.cell.arm_names]
        if len({len(r) for r in rows}) != 1:
            raise MmpError("clearance: every arm needs the same number of rows")
        return core.cell_clearance(self.core, rows)

    def nearest(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> dict[str, Nearest]:
        """Returns the nearest bodies of one state, in double precision, for each kind of margin.

        The clearance of a kind without bodies, such as `obstacles` in a cell without obstacles, is infinite.

        Args:
            q: arm name -> [dof] [rad].
        """
        arms, names = self.cell.arms, [part_names(arm) for arm in self.cell.arms]
        self._require_arms(q)
        rows = [self._checked(arm.name, q[arm.name], (arm.dof,)) for arm in arms]
        out = {}
        for kind, near in zip(KINDS, core.nearest_bodies(self.core, rows), strict=True):
            if near.arm < 0:
                out[kind] = Nearest(clearance_m=math.inf, bodies="")
                continue
            first = f"{arms[near.arm].name}/{names[near.arm][near.link]}"
            if near.other_link < 0:
                second = f"obstacle/{self._solids[near.other]}"
            else:
                second = f"{arms[near.other].name}/{names[near.other][near.other_link]}"
            out[kind] = Nearest(clearance_m=near.clearance, bodies=f"{first} and {second}")
        return out

    def least_clearance(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> tuple[float, str]:
        """Returns the least clearance [m] of one state over all bodies, in double precision, and the nearest bodies."""
        least = min(self.nearest(q).values(), key=lambda near: near.clearance_m)
        return least.clearance_m, least.bodies or "nothing is near anything"

    def conflicts(self, plan: TimedPlan) -> list[Conflict]:
        """Returns the conflicts of a plan, earliest first; see `mmp_env.model.conflict`."""
        return plan_conflicts(self, plan)

    def motion(self, arm: str, q: Float[np.ndarray, "k dof"]) -> core.Motion:
        """Returns a compiled trajectory on the grid of steps [k, dof] [rad], for `conflict_instants` and repulsion."""
        rows = self._rows(arm, q)
        if not len(rows):
            raise MmpError(f"motion: arm '{arm}' has no configurations; a motion needs one at least")
        return core.Motion(self.core, self.index(arm), rows)

    def conflict_instants(
        self, motions: Sequence[core.Motion], pairs: ArrayLike, levels: core.Levels, *, bases: bool = False
    ) -> list[Float[np.ndarray, "c"]]:
        """Returns the instants of conflict [steps] of each pair of indices into `motions`, ascending.

        There is at most one instant per step: a whole number if surfaces are closer than `levels.margin` at the step,
        otherwise one between two steps. Between all other steps `levels.proof` is proved.

        Args:
            pairs: indices into `motions` [p, 2].
            bases: tests one arm's moving links against the other's base too. Paths that are free alone never touch it.
        """
        numbers = np.ascontiguousarray(pairs, dtype=np.int32).reshape(-1, 2)
        return core.conflict_instants(self.core, motions, numbers, levels, bases=bases)

    def _require_arms(self, q: Mapping[str, ArrayLike]) -> None:
        """Raises `MmpError` unless `q` is a mapping with all arms of the cell."""
        given("q", q, Mapping, "a mapping of arm name -> joints [rad]")
        for name in self.cell.arm_names:
            if name not in q:
                raise MmpError(f"q has no configuration for arm '{name}'")

    def _rows(self, arm: str, q: ArrayLike) -> Float[np.ndarray, "n dof"]:
        """Returns configurations that the core takes. Raises `MmpError`."""
        return self._checked(arm, q, ("n", self.cell.arms[self.index(arm)].dof))

    def _checked(self, arm: str, q: ArrayLike, shape: tuple[str | int, ...]) -> Float[np.ndarray, "*n dof"]:
        """Returns configurations of this shape, each number within `LARGEST_POSITION`. Raises `MmpError`."""
        rows = _finite(arm, q, shape)
        if np.abs(rows).max(initial=0.0) > LARGEST_POSITION:
            far, most = float(rows[np.abs(rows) > LARGEST_POSITION][0]), f"{LARGEST_POSITION:g}"
            raise MmpError(f"configurations of arm '{arm}' hold {far:g}; they must be from -{most} to {most}")
        return rows

    def _finite_rows(self, arm: str, q: ArrayLike) -> Float[np.ndarray, "n dof"]:
        """Returns configurations that may be too large for the core. Raises `MmpError`."""
        return _finite(arm, q, ("n", self.cell.arms[self.index(arm)].dof))


def _finite(arm: str, q: ArrayLike, shape: tuple[str | int, ...]) -> Float[np.ndarray, "*n dof"]:
    """Returns finite configurations of this shape, in which a name stands for any number. Raises `MmpError`."""
    rows = as_numbers(q)
    if rows is None:
        raise MmpError(f"configurations of arm '{arm}' are {shown(q)}; they must be numbers of shape {_words(shape)}")
    if rows.ndim != len(shape) or rows.shape[-1] != shape[-1]:
        raise MmpError(f"configurations of arm '{arm}' have shape {list(rows.shape)}; expected {_words(shape)}")
    if not np.isfinite(rows).all():
        raise MmpError(f"configurations of arm '{arm}' hold {rows[~np.isfinite(rows)][0]}; they must be finite")
    return np.ascontiguousarray(rows)


def _words(shape: tuple[str | int, ...]) -> str:
    return f"[{', '.join(map(str, shape))}]"


def _pose_and_size(obstacle: Obstacle) -> tuple[Float[np.ndarray, "12"], Float[np.ndarray, "3"]]:
    """Returns pose and size of an obstacle as the core takes them."""
    return obstacle.pose[:3].ravel(), np.ascontiguousarray(obstacle.half_size, dtype=float)
