"""Combinations of candidates, one of each arm, that are free together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.cell import Cell
from mmp_env.problems.candidates import Candidates

MOST_TRIED = 5000
"""Largest number of postures that one search tries."""


@dataclass(frozen=True, kw_only=True)
class BlockedPair:
    """Two arms of which no two candidates are free together, and the candidates that are farthest apart."""

    names: tuple[str, str]
    best: tuple[int, int]


class Combinations:
    """A depth-first search for combinations in which any two arms keep a clearance.

    It goes on with the arm that has the fewest candidates left. It knows the nearest candidate of every posture.

    Args:
        cell: the cell.
        candidates: arm name -> its candidates.
        clearance: that any two arms keep [m].
    """

    def __init__(self, cell: Cell, candidates: Mapping[str, Candidates], clearance: float) -> None:
        self._cell, self._clearance, self._names = cell, clearance, cell.arm_names
        self._indices = [candidates[name].nearest_of_postures for name in self._names]
        self._rows = [
            np.ascontiguousarray(candidates[name].q[some])
            for name, some in zip(self._names, self._indices, strict=True)
        ]
        self._known: dict[tuple[int, int, int], Bool[np.ndarray, "m"]] = {}
        self._tried = 0

    def first(self) -> dict[str, int] | None:
        """Returns arm name -> index of its candidate in the first combination that is found, or None."""
        self._tried = 0
        found = self._extend({}, {a: np.ones(len(rows), dtype=bool) for a, rows in enumerate(self._rows)})
        if found is None:
            return None
        return {name: int(self._indices[a][found[a]]) for a, name in enumerate(self._names)}

    def blocked_pair(self) -> BlockedPair | None:
        """Returns the first two arms of which no two candidates are free together, or None."""
        for a, rows_a in enumerate(self._rows):
            for b, rows_b in enumerate(self._rows[:a]):
                gaps = np.stack([self._gaps(b, j, a) for j in range(len(rows_b))])
                if gaps.max() < self._clearance:
                    j, i = divmod(int(gaps.argmax()), len(rows_a))
                    best = int(self._indices[b][j]), int(self._indices[a][i])
                    return BlockedPair(names=(self._names[b], self._names[a]), best=best)
        return None

    def _extend(self, choice: dict[int, int], left: dict[int, Bool[np.ndarray, "m"]]) -> dict[int, int] | None:
        """Returns a choice for all arms, or None.

        Args:
            choice: arm -> its posture.
            left: arm without a choice -> which of its postures fit the choice.
        """
        if not left:
            return choice
        a = min(left, key=lambda arm: int(left[arm].sum()))
        for i in np.flatnonzero(left[a]):
            if self._tried >= MOST_TRIED:
                return None
            self._tried += 1
            narrowed = {b: fit & self._fits(a, int(i), b) for b, fit in left.items() if b != a}
            if all(fit.any() for fit in narrowed.values()):
                complete = self._extend({**choice, a: int(i)}, narrowed)
                if complete is not None:
                    return complete
        return None

    def _fits(self, a: int, i: int, b: int) -> Bool[np.ndarray, "m"]:
        """Returns which postures of arm `b` are clear of posture `i` of arm `a`."""
        if (a, i, b) not in self._known:
            self._known[a, i, b] = self._gaps(a, i, b) >= self._clearance
        return self._known[a, i, b]

    def _gaps(self, a: int, i: int, b: int) -> Float[np.ndarray, "m"]:
        """Returns the clearances [m] of posture `i` of arm `a` from all postures of arm `b`."""
        here = np.repeat(self._rows[a][i : i + 1], len(self._rows[b]), axis=0)
        return self._cell.collision.pair_clearance(self._names[a], here, self._names[b], self._rows[b])
