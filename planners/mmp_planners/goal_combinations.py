"""Combinations of candidates, one of each arm, that are free together: the roots of the composite goal tree."""

from __future__ import annotations

import heapq

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
    chosen = np.concatenate([problem.goal[name] for name in problem.cell.arm_names])
    if all(len(rows) == 1 for rows in problem.goals.values()):
        return chosen[None]
    candidates = _Candidates(problem)
    cheapest = candidates.cheapest(int(CHEAPEST_SHARE * MOST_COMBINATIONS))
    drawn = candidates.drawn(MOST_COMBINATIONS - len(cheapest) - 1, np.random.default_rng(seed))
    found = [candidates.joints(choice) for choice in dict.fromkeys([*cheapest, *drawn])] + [chosen]
    start = np.concatenate([problem.start[name] for name in problem.cell.arm_names])
    rows = np.unique(np.array(found), axis=0)
    return np.ascontiguousarray(rows[np.abs(rows - start).sum(axis=1).argsort(kind="stable")])


class _Candidates:
    """The candidates of every arm, the nearest first, and which of two arms are free together."""

    def __init__(self, problem: Problem) -> None:
        self._problem, self._names = problem, problem.cell.arm_names
        self._rows = [few(problem.goals[name], MOST_PER_ARM) for name in self._names]
        self._costs = [
            np.abs(rows - problem.start[name]).sum(axis=1) for name, rows in zip(self._names, self._rows, strict=True)
        ]
        self._free_pairs: dict[tuple[int, int], Bool[np.ndarray, "n m"]] = {}

    def joints(self, choice: tuple[int, ...]) -> Float[np.ndarray, "all_dof"]:
        """Returns the joints of all arms [rad]."""
        return np.concatenate([rows[k] for rows, k in zip(self._rows, choice, strict=True)])

    def cheapest(self, count: int) -> list[tuple[int, ...]]:
        """Returns the cheapest free combinations, as indices of candidates (best-first search over the arms)."""
        least = [float(costs[0]) for costs in self._costs]
        queue: list[tuple[float, tuple[int, ...]]] = [(sum(least), (0,))]
        found: list[tuple[int, ...]] = []
        for _ in range(MOST_EXPANDED):
            if not queue or len(found) == count:
                break
            bound, choice = heapq.heappop(queue)
            arm, last = len(choice) - 1, choice[-1]
            costs = self._costs[arm]
            if last + 1 < len(costs):
                heapq.heappush(queue, (bound + float(costs[last + 1] - costs[last]), (*choice[:-1], last + 1)))
            if not self._fits(arm, last, choice[:-1]):
                continue
            if len(choice) == len(self._names):
                found.append(choice)
            else:
                heapq.heappush(queue, (bound, (*choice, 0)))
        return found

    def drawn(self, count: int, rng: np.random.Generator) -> list[tuple[int, ...]]:
        """Returns free combinations of at most `count` draws: arm by arm in a random order, near candidates rather."""
        found = []
        for _ in range(count):
            choice: dict[int, int] = {}
            for arm in rng.permutation(len(self._names)).tolist():
                fits = np.ones(len(self._rows[arm]), dtype=bool)
                for other, k in choice.items():
                    fits &= self._free(arm, other)[:, k]
                allowed = np.flatnonzero(fits)
                if not len(allowed):
                    break
                choice[arm] = int(allowed[int(len(allowed) * rng.random() ** 2)])
            if len(choice) == len(self._names):
                found.append(tuple(choice[arm] for arm in range(len(self._names))))
        return found

    def _fits(self, arm: int, k: int, before: tuple[int, ...]) -> bool:
        return all(self._free(arm, other)[k, j] for other, j in enumerate(before))

    def _free(self, a: int, b: int) -> Bool[np.ndarray, "n m"]:
        """Returns which candidates of arm `a` are free together with which of arm `b`."""
        if a > b:
            return self._free(b, a).T
        if (a, b) not in self._free_pairs:
            n, m = len(self._rows[a]), len(self._rows[b])
            clearance = self._problem.cell.collision.pair_clearance(
                self._names[a], np.repeat(self._rows[a], m, axis=0), self._names[b], np.tile(self._rows[b], (n, 1))
            )
            self._free_pairs[a, b] = (clearance >= self._problem.conflict_distances.arms).reshape(n, m)
        return self._free_pairs[a, b]
