"""Combinations of candidates, one of each arm, that are free together: the roots of the composite goal tree."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.problem import Problem
from mmp_planners.goal_choice import few

MOST_COMBINATIONS = 32
"""Largest number of combinations."""
CHEAPEST_SHARE = 0.5
"""Share of the cheapest combinations; the others are drawn, so that no arm has the same candidate in all of them."""
MOST_PER_ARM = 16
"""Largest number of candidates of an arm in the combinations."""
MOST_EXPANDED = 500
"""Largest number of partial combinations that the search for the cheapest ones expands."""


def goal_combinations(problem: Problem, seed: int) -> Float[np.ndarray, "n all_dof"]:
    """Returns combinations of candidates that are free together, all joints of all arms [rad]; the cheapest first.

    The first one is the goal of the problem, or one that is cheaper. The same seed gives the same combinations.
    """
    chosen = problem.joint_goal
    if problem.single_goals:
        return chosen[None]
    candidates = _Candidates(problem)
    cheapest = candidates.cheapest(int(CHEAPEST_SHARE * MOST_COMBINATIONS))
    drawn = candidates.drawn(MOST_COMBINATIONS - len(cheapest) - 1, np.random.default_rng(seed))
    found = [candidates.joints(choice) for choice in dict.fromkeys([*cheapest, *drawn])]
    rows = np.array(found if any(np.array_equal(q, chosen) for q in found) else [*found, chosen])
    return np.ascontiguousarray(rows[np.abs(rows - problem.joint_start).sum(axis=1).argsort(kind="stable")])


class _Candidates:
    """The candidates of every arm, the nearest first, and which of two arms are free together.

    Sets of candidates of an arm are whole numbers, one bit a candidate: the search looks at hundreds of them.
    """

    def __init__(self, problem: Problem) -> None:
        self._rows = [few(problem.goals[name], MOST_PER_ARM) for name in problem.cell.arm_names]
        self._costs: list[list[float]] = [
            np.abs(rows - problem.start[name]).sum(axis=1).tolist()
            for name, rows in zip(problem.cell.arm_names, self._rows, strict=True)
        ]
        self._fitting: dict[tuple[int, int], list[int]] = {}
        for a, b in itertools.combinations(range(len(self._rows)), 2):
            free = _free_together(problem, self._rows, a, b)
            self._fitting[a, b], self._fitting[b, a] = _bits(free), _bits(free.T)

    def joints(self, choice: tuple[int, ...]) -> Float[np.ndarray, "all_dof"]:
        """Returns the joints of all arms [rad]."""
        return np.concatenate([rows[k] for rows, k in zip(self._rows, choice, strict=True)])

    def cheapest(self, count: int) -> list[tuple[int, ...]]:
        """Returns the cheapest free combinations, as indices of candidates (best-first search over the arms)."""
        queue: list[tuple[float, tuple[int, ...]]] = [(sum(costs[0] for costs in self._costs), (0,))]
        found: list[tuple[int, ...]] = []
        for _ in range(MOST_EXPANDED):
            if not queue or len(found) == count:
                break
            bound, choice = heapq.heappop(queue)
            arm, last = len(choice) - 1, choice[-1]
            costs = self._costs[arm]
            if last + 1 < len(costs):
                heapq.heappush(queue, (bound + costs[last + 1] - costs[last], (*choice[:-1], last + 1)))
            if not self._fitting_all(arm, enumerate(choice[:-1])) >> last & 1:
                continue
            if len(choice) == len(self._rows):
                found.append(choice)
            else:
                heapq.heappush(queue, (bound, (*choice, 0)))
        return found

    def drawn(self, count: int, rng: np.random.Generator) -> list[tuple[int, ...]]:
        """Returns free combinations of at most `count` draws: arm by arm in a random order, near candidates rather."""
        found = []
        for _ in range(count):
            choice: dict[int, int] = {}
            for arm in rng.permutation(len(self._rows)).tolist():
                fitting = self._fitting_all(arm, choice.items())
                allowed = [k for k in range(len(self._rows[arm])) if fitting >> k & 1]
                if not allowed:
                    break
                choice[arm] = allowed[int(len(allowed) * rng.random() ** 2)]
            if len(choice) == len(self._rows):
                found.append(tuple(choice[arm] for arm in range(len(self._rows))))
        return found

    def _fitting_all(self, arm: int, choice: Iterable[tuple[int, int]]) -> int:
        """Returns the set of candidates of an arm that are free together with chosen candidates of others."""
        fitting = (1 << len(self._rows[arm])) - 1
        for other, k in choice:
            fitting &= self._fitting[other, arm][k]
        return fitting


def _free_together(
    problem: Problem, rows: Sequence[Float[np.ndarray, "_ _"]], a: int, b: int
) -> Bool[np.ndarray, "n m"]:
    """Returns which candidates of arm `a` are free together with which of arm `b`."""
    n, m, names = len(rows[a]), len(rows[b]), problem.cell.arm_names
    clearance = problem.cell.collision.pair_clearance(
        names[a], np.repeat(rows[a], m, axis=0), names[b], np.tile(rows[b], (n, 1))
    )
    return np.asarray(clearance >= problem.conflict_distances.arms).reshape(n, m)


def _bits(free: Bool[np.ndarray, "n m"]) -> list[int]:
    """Returns the set of columns of each row."""
    return list((free @ (1 << np.arange(free.shape[1]))).tolist())
