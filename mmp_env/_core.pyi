"""
Native core of mmp-env: kinematics, clearance, proofs, single-arm search and repulsion. Arrays are float64.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


LANES: int = 4

FOREVER: int = 268435456

def cpu_level() -> int:
    """
    The x86-64 level (1, 3 or 4) that this processor supports; 1 elsewhere.
    """

class Clock:
    """
    Deadline in seconds from now, and a cancel flag. Long calls observe both, and Python signals.
    """

    def __init__(self, seconds: float) -> None: ...

    def cancel(self) -> None:
        """Ends every call that uses this clock, from any thread."""

    @property
    def expired(self) -> bool:
        """Whether the deadline has passed or the clock was cancelled."""

    @property
    def remaining(self) -> float:
        """Time left [s]."""

    def reserve(self, seconds: float) -> None:
        """
        Lets the clock expire earlier by a time [s], which replaces an earlier reserve.
        """

class Levels:
    """
    Distances between surfaces [m]. Closer than `margin` at a sample is a contact; `proof` is proved at every instant. Both hold between two arms. `obstacles` is added for an arm and an obstacle, `own` for two parts of one arm, `upright` for the room of an upright tool.
    """

    def __init__(self, margin: float, proof: float, obstacles: float = 0.0, own: float = 0.0, upright: float = 0.0) -> None: ...

    @property
    def margin(self) -> float: ...

    @property
    def proof(self) -> float: ...

    @property
    def obstacles(self) -> float: ...

    @property
    def own(self) -> float: ...

    @property
    def upright(self) -> float: ...

class Cell:
    """Arms and obstacles of a cell. Add all of them, then freeze it."""

    def __init__(self) -> None: ...

    def add_arm(self, *, fixed: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], tool: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], slides: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], link_frames: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], spheres: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], sphere_links: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], self_pairs: Annotated[NDArray[numpy.int32], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> None:
        """
        Adds an arm. fixed [dof, 12]: rows of T_frame(k)_frame(k+1) at q = 0, joint axis z, the first frame in the world. slides [dof]: whether a joint moves along the axis [m] instead of turning about it [rad]. spheres [s, 4]: centre and radius in the frame of their link, the base's (link 0) in the world. self_pairs [p, 2]: links that must not touch, the one nearer to the base first.
        """

    def add_obstacle(self, shape: int, pose: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], size: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None:
        """
        Adds an obstacle. shape: 0 box, 1 sphere, 2 cylinder, 3 capsule. pose [12]: rows of T_world_obstacle. size [3] [m]: half edges of a box; radius and half length of other shapes.
        """

    def add_hull(self, *, arm: int, link: int, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], radius: float = 0.0, protrusion: float = 1000000000.0) -> None:
        """
        Adds a convex hull to a link, in the frame of its spheres, which must cover it. vertices [n, 3] [m], grown by a ball of `radius` [m]. protrusion [m]: no point of the link's spheres is farther from its hulls. Where spheres come close, the hulls of two links decide if both have some.
        """

    def add_hull_obstacle(self, *, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], planes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], radius: float = 0.0) -> None:
        """
        Adds a convex obstacle. vertices [n, 3] [m] in the world, grown by `radius` [m]. planes [p, 4]: unit normals and offsets, the hull of the vertices is where n.x <= offset.
        """

    def let_touch(self, *, obstacle: int, arm: int, link: int) -> None:
        """Lets a moving link touch an obstacle: no query tests the two."""

    def freeze(self) -> None:
        """Ends the construction. Only a frozen cell answers queries."""

def hull_distances(*, a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], radius_a: float = 0.0, radius_b: float = 0.0) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    Returns bounds of the distance of two convex hulls [n, 2] [m]: a certified lower one, minus infinity where they overlap, and an upper one. a, b: vertices [m], grown by balls. poses [n, 2, 12]: rows of the transforms of a and b. [n, 4, 12]: also where their points have moved straight to; the bounds then hold for the whole motion.
    """

class NearestBodies:
    """Two bodies and their distance."""

    @property
    def clearance(self) -> float:
        """Distance of the surfaces [m]."""

    @property
    def arm(self) -> int:
        """Arm of the first body; -1 if there are no such bodies."""

    @property
    def link(self) -> int:
        """Link of the first body."""

    @property
    def other(self) -> int:
        """Arm of the second body, or obstacle."""

    @property
    def other_link(self) -> int:
        """Link of the second body; -1 for an obstacle."""

class Proof:
    """Result of `certify`."""

    @property
    def valid(self) -> bool:
        """Whether `clearance` is proved."""

    @property
    def clearance(self) -> float:
        """Proved clearance between arms [m]; if not valid, one that is violated."""

    @property
    def arm_a(self) -> int:
        """Arm with the least clearance, or with a violation."""

    @property
    def arm_b(self) -> int:
        """Other arm; -1: `arm_a` alone."""

    @property
    def segment(self) -> int:
        """Segment of the least clearance, or of the violation."""

    @property
    def fraction(self) -> float:
        """Fraction of that segment."""

def spheres(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
    """Returns sphere centres [n, s, 3] [m] in the order of `sphere_table`."""

def sphere_table(cell: Cell, arm: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """Returns link index and radius [m] of every sphere, [s, 2]."""

def tool_points(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """Returns tool points [n, 3] [m] in the world."""

def static_clearance(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], *, precise: bool = False) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Returns the clearance [n] [m] of one arm from obstacles, the other arms' bases and itself.
    """

def pair_clearance(cell: Cell, a: int, qa: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], b: int, qb: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], *, precise: bool = False) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """Returns the clearance [n] [m] between two arms, bases included."""

def swept_clearance(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], shape: int, pose: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], size: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], *, stray: float = 0.0) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Returns lower bounds [n - 1] [m] of the clearance of the moving links of one arm from a body, at every instant of the straight segments between the rows of q [n, dof]. `stray`: the arm may be so far from them in every joint. The body is one as of `add_obstacle` that is not in the cell.
    """

def cell_clearance(cell: Cell, q: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]], *, obstacles: bool = True) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Returns the least clearance [n] [m] of whole states over all pairs of arms, and with `obstacles` over arms and obstacles.
    """

def nearest_bodies(cell: Cell, q: Sequence[numpy.ndarray]) -> list[NearestBodies]:
    """
    Returns, for one state q [dof] per arm, the nearest two arms, the nearest arm and obstacle, and the nearest parts of one arm, in double precision.
    """

def edges_free(cell: Cell, arm: int, q_from: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], q_to: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], levels: Levels) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]:
    """
    Returns whether straight segments keep `proof` at every instant and `margin` at the samples, against obstacles, other bases and the arm itself. Joint limits are the caller's task.
    """

def certify(cell: Cell, q: Sequence[numpy.ndarray], required: Levels, share: float, clock: Clock) -> Proof:
    """
    Proves a clearance along q [n, dof] per arm, linear in between: at least `required.proof`, and all but a `share` of what the sampled clearance has beyond it.
    """

def keep_upright(cell: Cell, arm: int, axis: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], within: float) -> None:
    """
    Bounds the angle between an axis of the tool and the world's z axis, in a cell that is not frozen. axis [3]: unit vector in the tool frame. within: largest angle [rad], at most a right angle.
    """

def tool_axes(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    Returns the directions [n, 3] in the world of the tool axis that an arm keeps upright.
    """

def project_upright(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.bool_], dict(shape=(None,))]]:
    """
    Returns configurations [n, dof] moved inside the bound of the tool axis and within the joint limits, and whether that worked [n].
    """

class Motion:
    """One arm's trajectory on the grid of steps, with its sphere centres."""

    def __init__(self, cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def arm(self) -> int: ...

    @property
    def last(self) -> int:
        """Index of the last step."""

    def may_be_near(self, other: Motion, distance: float) -> bool:
        """
        Returns whether boxes around all moving links at all steps are closer than `distance` [m].
        """

def conflict_instants(cell: Cell, motions: Sequence[Motion], pairs: numpy.ndarray, levels: Levels, *, bases: bool = False) -> list[numpy.ndarray]:
    """
    Returns the instants of conflict of each pair of motions, in steps, ascending. An integer: surfaces are closer than `margin` at that step. A fraction: a contact between two steps. Elsewhere `proof` is proved at every instant. A motion stays at its last step forever. `bases` also tests moving links against the other's base.
    """

def swept_conflicts(first: Motion, second: Motion, distance: float) -> numpy.ndarray:
    """
    Returns which steps of two motions [steps of the first, steps of the second] may come closer than `distance` [m], whenever the arms do them. The motions may be of two cells, such as with and without a held object. Spheres decide, also where arms have hulls. A motion of one configuration counts as one step.
    """

class Constraint:
    """
    Region that one arm must avoid in the open window (start, end) of steps; at one instant if both are equal.
    """

    @staticmethod
    def ball(center: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], radius: float, start: float, end: float) -> Constraint:
        """Forbids every joint to be within `radius` [rad] of a configuration."""

    @staticmethod
    def standing(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], *, shrink: float = 0.0, start: float, end: float) -> Constraint:
        """
        Forbids contact with another arm that stands at q, its spheres smaller by `shrink` [m].
        """

    @staticmethod
    def moving(motion: Motion, start: float, end: float) -> list[Constraint]:
        """
        Forbids contact with another arm that moves, from step `start` to `end`: one constraint per step.
        """

    @staticmethod
    def sphere(center: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], radius: float, first_link: int, start: float, end: float) -> Constraint:
        """
        Forbids contact of links from `first_link` on with a sphere in the world.
        """

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

STEERING_RAD: float = 0.8

class SingleArmSettings:
    """Settings of one call of `SingleArm.plan`."""

    def __init__(self, *, max_iterations: int = 2000, improve_iterations: int = 0, shortcuts: int = 40, goal_bias: float = 0.1, neighbours: int = 6, direct: bool = True, static_tree: bool = True) -> None: ...

    @property
    def max_iterations(self) -> int:
        """Largest number of iterations until the first path."""

    @property
    def improve_iterations(self) -> int:
        """Iterations after the first path."""

    @property
    def shortcuts(self) -> int:
        """Attempts to shorten the path."""

    @property
    def goal_bias(self) -> float:
        """Share of samples at the goal."""

    @property
    def neighbours(self) -> int:
        """Largest number of neighbours that a sample is connected to."""

    @property
    def direct(self) -> bool:
        """
        Whether paths that need no sampling are tried first: straight lines, and the branch of the static tree.
        """

    @property
    def static_tree(self) -> bool:
        """Whether the static goal tree is used: its branches, and samples of it."""

def safe_intervals(cell: Cell, arm: int, q: numpy.ndarray, constraints: Sequence[Constraint], levels: Levels, *, others: Sequence[Motion] = ()) -> numpy.ndarray:
    """
    Returns the safe intervals [m, 2] of a configuration, in whole steps [first, last]; the last one may end at FOREVER. `others`: motions of other arms, which stay `levels` away.
    """

class SingleArm:
    """
    Planner of one arm in space and time (SI-RRT*). It keeps what does not depend on constraints.
    """

    def __init__(self, cell: Cell, arm: int, *, start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], goals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], max_step: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], levels: Levels, seed: int, eta: float = 0.8) -> None:
        """
        `goals` [n, dof]: a path may end at any of them. `max_step` [dof]: largest move of each joint in one step [rad]; `eta`: steering distance [rad].
        """

    def plan(self, constraints: Sequence[Constraint], seed: int, clock: Clock, *, settings: SingleArmSettings = ..., others: Sequence[Motion] = (), experience: numpy.ndarray | None = None) -> tuple[numpy.ndarray | None, int]:
        """
        Returns a trajectory [steps + 1, dof] on the grid, or None, and the number of iterations. The trajectory is proved clear of `others`, motions of other arms that stay at their last step. `experience` [k, dof]: earlier trajectory that the search starts from.
        """

def search_tree(arm: SingleArm, *, others: Sequence[Motion], seed: int, clock: Clock, iterations: int) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray | None]:
    """
    Returns a snapshot of the tree that SI-RRT* grows among `others`: configurations [v, dof], the arrival step and the parent vertex of each [v, 2] (-1: none), and the path, or None.
    """

class RepulsionSettings:
    """Settings of the repulsive force field, and of the descent along it."""

    def __init__(self, *, k_rep: float = 0.05, d0: float = 0.1, centre_distance: bool = False, alpha: float = 1e-07, max_iterations: int = 50, normalised: bool = False, normalised_step: float = 0.03, floor: float = 0.01, max_step: float = 0.05, stretch: float = 3.0, comfort: float = 0.02, exact_within: float = 0.0, halvings: int = 0) -> None: ...

    @property
    def k_rep(self) -> float:
        """Gain of the force."""

    @property
    def d0(self) -> float:
        """Range of the force [m]."""

    @property
    def centre_distance(self) -> bool:
        """
        Paper-literal setting: distances between sphere centres instead of surfaces.
        """

    @property
    def alpha(self) -> float:
        """Step of the descent."""

    @property
    def max_iterations(self) -> int:
        """Largest number of iterations."""

    @property
    def normalised(self) -> bool:
        """Fixed largest step; forces are smoothed over time."""

    @property
    def normalised_step(self) -> float:
        """Largest step of a normalised iteration [rad]."""

    @property
    def floor(self) -> float:
        """Distance below which the force is constant [m]; 0: none."""

    @property
    def max_step(self) -> float:
        """Largest step of a joint in one iteration [rad]; 0: any."""

    @property
    def stretch(self) -> float:
        """
        Longest move between two waypoints, relative to one step at full speed; 0: any.
        """

    @property
    def comfort(self) -> float:
        """Clearance that ends the descent [m]; negative: never."""

    @property
    def exact_within(self) -> float:
        """
        Distance of hulls below which they give the direction of the force [m]; 0: never.
        """

    @property
    def halvings(self) -> int:
        """How often a step that would end the descent is halved first."""

class ModifiedMotion:
    """Result of `modify_motion`."""

    @property
    def positions(self) -> numpy.ndarray:
        """Last iterate [steps + 1, dof] that breaks no constraint."""

    @property
    def moved(self) -> bool:
        """Whether `positions` differ from the input."""

    @property
    def iterations(self) -> int:
        """Number of accepted iterations."""

    @property
    def input_breaks_constraint(self) -> bool:
        """Whether the input breaks a constraint."""

    @property
    def trace(self) -> list[numpy.ndarray]:
        """All accepted iterates if `trace` was set, else empty."""

def repulsive_force(cell: Cell, motion: Motion, others: Sequence[Motion], settings: RepulsionSettings) -> numpy.ndarray:
    """
    Returns the joint forces J^T F [steps + 1, dof] of the field on a motion, zero at both ends.
    """

def modify_motion(cell: Cell, motion: Motion, *, others: Sequence[Motion], constraints: Sequence[Constraint], max_step_rad: numpy.ndarray, levels: Levels, constraint_margin: float, settings: RepulsionSettings, clock: Clock, trace: bool = False) -> ModifiedMotion:
    """
    Moves a motion away from the others along the repulsive force (ModifyMotion of APF-ECBS). `levels` hold against static bodies. A constraint is broken when surfaces come closer than `constraint_margin` [m] in its window.
    """

def breaks_constraint(cell: Cell, motion: Motion, constraints: Sequence[Constraint], margin: float) -> bool:
    """
    Returns whether a motion comes closer than `margin` [m] to a forbidden region within its window.
    """

class CompositeSettings:
    """Settings of `CompositeSearch`."""

    def __init__(self, *, range: float = 2.0, step: float = 0.12) -> None: ...

    @property
    def range(self) -> float:
        """Longest move of an arm on an edge, L2 [rad]."""

    @property
    def step(self) -> float:
        """Distance between samples of an edge, largest joint [rad]."""

class CompositeSearch:
    """
    RRT-Connect over all joints of all arms, or of some. The search can be continued.
    """

    def __init__(self, cell: Cell, *, start: numpy.ndarray, goals: numpy.ndarray, samples: Levels, edges: Levels, seed: int, settings: CompositeSettings = ..., arms: Sequence[int] | None = None) -> None:
        """
        `start` [all joints]; `goals` [n, all joints]: a path may end at any of them. `samples`: levels at the samples of an edge; `edges`: levels that are proved along a path. `arms`, ascending: only these are searched, and only bases are there of the others; without it, all.
        """

    @property
    def nodes(self) -> int:
        """Number of nodes of both trees."""

    def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None:
        """
        Returns a path [n, all joints], proved at every instant, or None if `iterations` more do not find one.
        """

    @property
    def iterations(self) -> int:
        """Number of iterations so far."""

    @property
    def steps(self) -> int:
        """Number of steps of all arms so far, with those that added no node."""

class GroupSearch:
    """RRT-Connect for growing groups of arms. The search can be continued."""

    def __init__(self, cell: Cell, *, start: numpy.ndarray, goal: numpy.ndarray, samples: Levels, edges: Levels, seed: int, settings: CompositeSettings = ..., most: int = ...) -> None:
        """
        `start` and `goal` [all joints]. `samples`: levels at the samples of an edge; `edges`: levels that are proved along a path. `most`: largest number of arms in a group.
        """

    def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None:
        """
        Returns a path [n, all joints], proved at every instant, or None if `iterations` more do not find one.
        """

    @property
    def iterations(self) -> int:
        """Number of iterations so far."""

    @property
    def steps(self) -> int:
        """Number of steps of all arms so far, with those that added no node."""

class ShortcutSettings:
    """Settings of `shortcut`."""

    def __init__(self, *, attempts: int, min_saving: float = ...) -> None: ...

    @property
    def attempts(self) -> int:
        """Attempts per round."""

    @property
    def min_saving(self) -> float:
        """
        Minimum relative saving of a round for another round; infinity, the default: one round.
        """

def shortcut(cell: Cell, q: Sequence[numpy.ndarray], max_step: Sequence[numpy.ndarray], *, goals: Sequence[numpy.ndarray], levels: Levels, groups: Sequence[int], settings: ShortcutSettings, seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]:
    """
    Shortens a safe plan q [steps + 1, dof] per arm on the common clock. `goals` [n, dof] per arm: where it may end. Returns the shorter plan and the number of replaced motion windows. `levels` are proved for every arm and every pair at every instant. Arms in different `groups` ignore each other.
    """

def replan(cell: Cell, q: Sequence[numpy.ndarray], max_step: Sequence[numpy.ndarray], *, goals: Sequence[numpy.ndarray], levels: Levels, attempts: int, seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]:
    """
    Large-neighbourhood search: replans one arm of a safe plan q [steps + 1, dof] per arm, or two if another must make room. `goals` [n, dof] per arm: where it may end. Returns the shorter plan and the number of successful attempts. `levels` are proved for every new path.
    """

def remove_waits(cell: Cell, q: Sequence[numpy.ndarray], max_velocity: Sequence[numpy.ndarray], *, distance: float, clock: Clock) -> list[numpy.ndarray] | None:
    """
    Lets every arm of a plan q [n, dof] move as soon as those that pass before it let it. Paths and order stay. Steps whose swept volumes keep `distance` [m] may take place at any times. Returns the configurations [m, dof] of each arm at new common times; None without time.
    """

class PathRecombination:
    """
    Pool of known paths per arm, and combinations of them. Not safe for use by several threads at once.
    """

    def __init__(self, cell: Cell, max_step: Sequence[numpy.ndarray], levels: Levels) -> None:
        """
        `max_step` [dof] per arm: largest move of each joint in one step [rad]. `levels` hold between arms.
        """

    def add(self, q: Sequence[numpy.ndarray]) -> list[int]:
        """
        Adds one path [n, dof] per arm on a grid of steps, free alone, from its start to its goal. Evicts the longest path when the pool is full. Returns path ids, or -1 for a path that was not added.
        """

    def has(self, path_ids: Sequence[int]) -> bool:
        """Returns whether the pool holds these paths, one per arm."""

    def shortest(self) -> list[int]:
        """
        Returns the id of the shortest path of each arm, -1 for an arm without paths.
        """

    def path(self, arm: int, path_id: int) -> numpy.ndarray:
        """Returns a path [steps + 1, dof] in as few steps as full speed allows."""

    def infeasible_pairs(self, path_ids: Sequence[int], clock: Clock) -> list[tuple[int, int]]:
        """
        Returns the pairs of arms whose paths have an infeasible coordination diagram: no schedule takes both arms to their ends. When the clock ends, returns the pairs found so far.
        """

    def recombine(self, limit: float, clock: Clock) -> list[numpy.ndarray] | None:
        """
        Returns trajectories [steps + 1, dof] per arm along a combination of paths with total length below `limit` [rad], proved clear of each other, or None. Never returns a combination twice.
        """

def solve_six_hinges(axes: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], spherical: bool, miss: float) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.int32], dict(shape=(None, None))]]:
    """
    Returns joint angles [m, 6] [rad] near solutions of chains of six hinges, and the index of the chain of each [m, 1]. axes [n, 6, 3], offsets [n, 7, 3]: at zero positions. poses [n, 4, 4]: of the last frame, which is parallel to the base frame at zero positions. spherical: whether the last three axes meet; otherwise axes 2 to 4 are parallel, and axes 5 and 6 meet. miss: largest error of the position of a spherical wrist [arm lengths].
    """

def refine_tool_pose(*, axes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], slides: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], tool: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rows: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], steps: int, farthest: float) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.int32], dict(shape=(None, None))]]:
    """
    Returns the configurations [m, dof] that the Levenberg-Marquardt method brings to their poses, and their indices [m, 1]. axes [dof, 3], offsets [dof + 1, 3], tool [3, 3]: the chain at zero positions. rows: 3 for a position, 5 with the tool's z axis, 6 with its rotation. q [n, dof] [rad or m]. poses [n, 4, 4]. steps: largest number of steps. farthest: largest error to begin with [rad, or arm lengths].
    """

def self_motions(*, axes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], slides: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], tool: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rows: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], pose: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], step: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    Returns configurations [m, dof] within the limits on the curves through others, so that neighbours on a curve are at most a step apart. axes, offsets, slides, tool, rows: as of refine_tool_pose; the chain has one joint more than rows. q [n, dof] [rad or m]: with the tool at the pose [4, 4]. step: over all joints together [rad].
    """

def with_turns(q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], hinges: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], near: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], limit: int) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None))], Annotated[NDArray[numpy.int32], dict(shape=(None, None))]]:
    """
    Returns configurations [m, dof] with all turns of their hinges within the limits, and the index in `q` of each [m, 1]: the `limit` nearest to `near` by the sum over the joints, the nearest first. q [n, dof]: with the least turns above the lower limits.
    """

def deepest_balls(points: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], centers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.int32], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
    """
    Returns the ball in which each point [n, 3] [m] lies deepest, the first of several, and how far [m] the point is outside it.
    """

def points_in_balls(points: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], depth: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], centers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.int32], dict(shape=(None,))], Annotated[NDArray[numpy.int32], dict(shape=(None,))]]:
    """
    Returns which points [n, 3] [m] lie at least `depth` [n] [m] deep in which balls: numbers of both, in ascending order.
    """

def plane_depths(points: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], planes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Returns how deep [n] [m] points [n, 3] [m] lie inside half-spaces [p, 4] (n, n.x <= d), negative outside.
    """

def small_cover(*, samples: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], candidates: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], sample_count: int, candidate_count: int, chosen: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], draws: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.int32], dict(shape=(None,))]:
    """
    Returns few candidates that cover all samples that any candidate covers: candidate candidates[k] covers samples[k]. It begins with `chosen`, adds candidates greedily, and makes len(draws) steps of a local search (RWLS), each with a random number from 0 to 1.
    """
