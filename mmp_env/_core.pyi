"""
Native core of mmp-env: kinematics, clearance, proofs, single-arm search and repulsion. Arrays are float64.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


LANES: int = 8

FOREVER: int = 268435456

def cpu_level() -> int:
    """
    The x86-64 level (1, 3 or 4) that this processor supports; 1 elsewhere.
    """

class Clock:
    """
    A deadline in seconds from now, and a flag; long calls look at both and at signals.
    """

    def __init__(self, seconds: float) -> None: ...

    def cancel(self) -> None:
        """Ends every call that holds this clock, from any thread."""

    @property
    def expired(self) -> bool: ...

    @property
    def remaining(self) -> float:
        """[s]"""

class Levels:
    """
    Distances [m]: closer than `margin` is a contact where looked at; `proof` is proved of every instant. Both hold between two arms; `obstacles` is added for an arm and an obstacle, `own` for two parts of one arm.
    """

    def __init__(self, margin: float, proof: float, obstacles: float = 0.0, own: float = 0.0) -> None: ...

    @property
    def margin(self) -> float: ...

    @property
    def proof(self) -> float: ...

    @property
    def obstacles(self) -> float: ...

    @property
    def own(self) -> float: ...

class Cell:
    """Arms and obstacles; add all of them, then freeze."""

    def __init__(self) -> None: ...

    def add_arm(self, fixed: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], tool: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], link_frames: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], spheres: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], sphere_links: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], self_pairs: Annotated[NDArray[numpy.int32], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> None:
        """
        fixed [dof, 12]: rows of T_frame(k)_frame(k+1) at q = 0, joint axis z, the first one in the world; spheres [s, 4] in the frame of their link, the base's (link 0) in the world; self_pairs [p, 2]: links that must not touch, the one nearer to the base first.
        """

    def add_obstacle(self, shape: int, pose: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], size: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None:
        """
        shape: 0 box, 1 sphere, 2 cylinder, 3 capsule; pose [12]: rows of T_world_obstacle; size [3] [m]: half edges of a box, radius and half length of others.
        """

    def freeze(self) -> None: ...

def spheres(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
    """Sphere centres [n, s, 3] [m] in the order of `sphere_table`."""

def sphere_table(cell: Cell, arm: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """Link index and radius [m] of every sphere, [s, 2]."""

def tool_points(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """Tool points [n, 3] [m] in the world."""

def static_clearance(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], precise: bool = False) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Clearance [n] [m] of one arm from obstacles, the other arms' bases and itself.
    """

def pair_clearance(cell: Cell, a: int, qa: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], b: int, qb: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], precise: bool = False) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """Clearance [n] [m] between two arms, bases included."""

def cell_clearance(cell: Cell, q: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]], obstacles: bool = True) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Least clearance [n] [m] of whole states over all pairs of arms and, with `obstacles`, arms and obstacles.
    """

def nearest_bodies(cell: Cell, q: Sequence[numpy.ndarray]) -> list[tuple[float, int, int, int, int]]:
    """
    Of one state q [dof] per arm, in double precision, the nearest two arms, the nearest arm and obstacle, and the nearest parts of one arm: (clearance [m], arm, link, other arm or obstacle, other link or -1) each.
    """

def edges_free(cell: Cell, arm: int, q_from: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], q_to: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], levels: Levels) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]:
    """
    Whether straight segments keep `proof` at every instant and `margin` where looked at: obstacles, other bases, self. Limits are the caller's.
    """

def certify(cell: Cell, q: Sequence[numpy.ndarray], required: Levels, share: float, clock: Clock) -> tuple[bool, float, int, int, int, float]:
    """
    Proves `required.proof` at least along q [n, dof] per arm, linear in between, and of what the sampled clearance has beyond it all but a `share`: (valid, clearance between arms, arm, other arm or -1, segment, fraction of it).
    """

class Motion:
    """One arm's trajectory on the grid of steps, its spheres worked out."""

    def __init__(self, cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def arm(self) -> int: ...

    @property
    def last(self) -> int:
        """Index of the last step."""

def conflict_instants(cell: Cell, motions: Sequence[Motion], pairs: numpy.ndarray, levels: Levels, bases: bool = False) -> list[numpy.ndarray]:
    """
    For each pair of motions the instants of conflict, in steps, ascending: whole where surfaces are closer than `margin` at a step, broken for a contact found between two. Elsewhere `proof` is proved to be kept at every instant. A motion stays at its last step for ever. With `bases`, moving links against the other's base too.
    """

class Constraint:
    """
    What one arm must not do in the open window (start, end) of steps; where they are equal, at that one instant.
    """

    @staticmethod
    def ball(center: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], radius: float, start: float, end: float) -> Constraint:
        """Being within `radius` [rad] of a configuration in every joint."""

    @staticmethod
    def standing(cell: Cell, arm: int, q: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], shrink: float, start: float, end: float) -> Constraint:
        """
        Touching another arm as it stands at q, its spheres smaller by `shrink` [m].
        """

    @staticmethod
    def moving(motion: Motion, start: float, end: float) -> list[Constraint]:
        """
        Touching another arm as it moves, from step `start` to `end`: a list of constraints, one a step.
        """

    @staticmethod
    def sphere(center: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], radius: float, first_link: int, start: float, end: float) -> Constraint:
        """Links from `first_link` on touching a sphere in the world."""

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

def safe_intervals(cell: Cell, arm: int, q: numpy.ndarray, constraints: Sequence[Constraint], levels: Levels, others: Sequence[Motion] = ()) -> numpy.ndarray:
    """
    Whole steps [lo, hi] between which the arm may stand at q, [m, 2]; the last may end at FOREVER. `others`: motions of other arms that `levels` are kept from.
    """

class SingleArm:
    """
    Plans one arm in space and time (SI-RRT*); keeps what does not depend on constraints.
    """

    def __init__(self, cell: Cell, arm: int, start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], goal: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], max_step: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], levels: Levels, seed: int, eta: float = 0.8) -> None: ...

    def plan(self, constraints: Sequence[Constraint], seed: int, clock: Clock, max_iterations: int = 2000, improve_iterations: int = 0, shortcuts: int = 40, goal_bias: float = 0.1, neighbours: int = 6, others: Sequence[Motion] = (), experience: numpy.ndarray | None = None) -> tuple[numpy.ndarray | None, int]:
        """
        Configurations [steps + 1, dof] on the grid, or None, and the iterations that it took. `others`: motions of other arms, parked at their last step for ever, that the path is proved to keep clear of. `experience` [k, dof]: a path on the grid that the search begins with as far as it holds.
        """

def repulsive_force(cell: Cell, motion: Motion, others: Sequence[Motion], k_rep: float, d0: float, centre_distance: bool) -> numpy.ndarray:
    """Joint forces J^T F [steps + 1, dof] on the inner steps of a motion."""

def modify_motion(cell: Cell, motion: Motion, others: Sequence[Motion], constraints: Sequence[Constraint], max_step_rad: numpy.ndarray, levels: Levels, constraint_margin: float, clock: Clock, alpha: float, k_rep: float, d0: float, max_iterations: int, centre_distance: bool, normalised: bool, normalised_step: float, max_step: float, comfort: float, trace: bool = False) -> tuple[numpy.ndarray, bool, int, bool, list[numpy.ndarray]]:
    """
    ModifyMotion: (positions, moved, iterations, whether the input broke a constraint, iterates if traced).
    """

def breaks_constraint(cell: Cell, motion: Motion, constraints: Sequence[Constraint], margin: float) -> bool:
    """
    Whether a motion comes closer than `margin` [m] to what its constraints forbid, within their windows.
    """

class CompositeSearch:
    """
    RRT-Connect in the space of all joints of all arms; can be asked to go on.
    """

    def __init__(self, cell: Cell, start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], goal: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], samples: Levels, edges: Levels, range: float, step: float, seed: int) -> None:
        """
        `samples`: margins of the states looked at along an edge; `edges`: of a path that was found.
        """

    def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None:
        """
        A way [n, all joints], proved at every instant, or None if that many more iterations found none.
        """

    @property
    def iterations(self) -> int:
        """Iterations so far."""

    @property
    def nodes(self) -> int:
        """Nodes of both trees."""

def shorten(cell: Cell, q: Sequence[numpy.ndarray], max_step: Sequence[numpy.ndarray], levels: Levels, groups: Sequence[int], attempts: int, worth: float, seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]:
    """
    Shortcuts on the common clock: q [steps + 1, dof] per arm of a safe plan; returns the shorter one and the number of stretches that were replaced. `levels` are proved of one arm and of pairs at every instant; arms of different `groups` pass through each other. As many attempts again as long as they shorten the ways by a share `worth`.
    """

def replan(cell: Cell, q: Sequence[numpy.ndarray], max_step: Sequence[numpy.ndarray], levels: Levels, attempts: int, seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]:
    """
    Shorter ways of single arms, for which another one may make room: q [steps + 1, dof] per arm of a safe plan; returns the shorter one and the number of attempts that succeeded. `levels` are proved of every new way.
    """

class Recombination:
    """Ways of several plans, put together anew. For one thread at a time."""

    def __init__(self, cell: Cell, max_step: Sequence[numpy.ndarray], levels: Levels) -> None: ...

    def add(self, q: Sequence[numpy.ndarray]) -> list[int]:
        """
        A way [n, dof] for each arm from its start to its goal, free alone, on a grid of steps. Returns the numbers of the ways that stand for them, -1 where one was not taken.
        """

    def has(self, choice: Sequence[int]) -> bool:
        """
        Whether there is a way with such a number for each arm; one may have had to go for a shorter one.
        """

    def shortest(self) -> list[int]:
        """The number of the shortest way of each arm."""

    def way(self, arm: int, number: int) -> numpy.ndarray:
        """A way [steps + 1, dof] in as few steps as full speed allows."""

    def closed(self, choice: Sequence[int], clock: Clock) -> list[tuple[int, int]]:
        """
        Pairs of arms that cannot both come to their ends on the ways with these numbers, whoever waits for whom; those found until the clock ends.
        """

    def run(self, limit: float, clock: Clock) -> list[numpy.ndarray] | None:
        """
        Motions [steps + 1, dof] per arm along ways that are shorter than `limit` [rad] together, or None if no choice of them can be driven at once that was not given before. `levels` are proved of every pair.
        """

def search_tree(arm: SingleArm, others: Sequence[Motion], seed: int, clock: Clock, iterations: int) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray | None]:
    """
    The tree that SI-RRT* has grown among `others` after so many iterations, whether it has found a path or not: configurations [v, dof], the step of arrival and the vertex before each [v, 2] (-1: none), and the path.
    """
