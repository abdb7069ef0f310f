"""First conflicts of two arms on straight paths to their goals."""

import math
from functools import cache

from support import two_arms

from mmp_env import core
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners.conflict_tree.node import Node
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext


def in_the_ring():
    cell = ring_cell(4)
    return make_problem(cell, *draw_instance(cell, seed=2))


CASES = {
    "passing": two_arms.passing,
    "close": lambda: two_arms.passing(1.0),
    "parked": two_arms.parked_arm_between,
    "between two steps": lambda: two_arms.turning((0.23, -0.8), (0.23, -0.8), 1.4),
    "in the first moments": lambda: two_arms.turning((0.1, -0.8), (0.1, -0.8), 1.2),
    "in the ring": in_the_ring,
}


@cache
def conflict(case):
    """Returns a planning context, straight paths to the goals, and their first conflict."""
    problem = CASES[case]()
    context = PlanningContext(problem, 0.1, SiRrtStar(iterations=4000), core.Clock(math.inf))
    context.reseed(0)
    paths = [context.low_level(k, (), 0)[0] for k in range(len(context.names))]
    none = tuple(() for _ in paths)
    root = Node(
        id=0,
        parent=None,
        paths=tuple(paths),
        constraints=none,
        bounds=tuple(path.length for path in paths),
        conflicts=context.conflicts(paths, context.pairs()),
    )
    return context, paths, root.first_conflict()
