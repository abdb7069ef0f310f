"""Problems whose tools stay upright: start at random, goal at the end of a random walk within the bound."""

from dataclasses import replace

import numpy as np

from mmp_env.model.keep import Upright
from mmp_env.problems.making import make_problem

CLEARANCE_M = 0.01
STEP_RAD = 0.2
AXIS = np.array([1.0, 0.0, 0.0])


def upright_problem(cell, seed, *, axis=AXIS, within=0.2, walks=6):
    """Returns a problem in which every arm of the cell keeps a tool axis upright."""
    rng = np.random.default_rng(seed)
    kept = replace(cell, keep={name: Upright(axis=axis, within=within) for name in cell.arm_names})
    start = drawn(kept, lambda arm: projected(kept, arm, anywhere(arm, rng)))
    goal = drawn(kept, lambda arm: walked(kept, arm, start[arm.name], rng, walks))
    return make_problem(kept, start, goal, name=f"upright/{seed}")


def anywhere(arm, rng):
    return rng.uniform(np.maximum(arm.robot.lower, -np.pi), np.minimum(arm.robot.upper, np.pi))


def projected(cell, arm, q):
    """Returns the configuration moved inside the bound, or None."""
    (moved,), (found,) = cell.collision.project_upright(arm.name, q[None])
    return moved if found else None


def drawn(cell, draw):
    """Returns arm name -> [dof] [rad], free together."""
    model = cell.collision
    while True:
        state = {}
        for arm in cell.arms:
            q = None
            while q is None or not model.is_free(arm.name, q[None], margin=CLEARANCE_M)[0]:
                q = draw(arm)
            state[arm.name] = q
        if model.clearance({name: q[None] for name, q in state.items()})[0] > CLEARANCE_M:
            return state


def walked(cell, arm, q, rng, walks):
    """Returns the end of a few walks towards random configurations, each as far as it is free."""
    for _ in range(walks):
        target = anywhere(arm, rng)
        while (far := np.abs(target - q).max()) > STEP_RAD:
            ahead = projected(cell, arm, q + STEP_RAD / far * (target - q))
            if ahead is None or np.abs(target - ahead).max() > far - STEP_RAD / 10:
                break
            if not cell.collision.edge_free(arm.name, q[None], ahead[None])[0]:
                break
            q = ahead
    return q
