"""Combinations of candidates, one of each arm, that are free together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell

MOST_TRIED = 20_000
"""Largest number of candidates that one search places."""
_SWEEPS = 4
"""Largest number of rounds in which arms change to cheaper candidates."""


@dataclass(frozen=True, kw_only=True)
class BlockedPair:
    """Two arms of which no two candidates are free together, and the candidates that are farthest apart."""

    names: tuple[str, str]
    best: tuple[int, int]


class Combinations:
    """A depth-first search for combinations in which any two arms keep a clearance.

    Args:
        cell: the cell.
        candidates: arm name -> [n, dof] [rad], the preferred ones first.
        clearance: that any two arms keep [m].
    """

    def __init__(self, cell: Cell, candidates: Mapping[str, Float[np.ndarray, "n dof"]], clearance: float) -> None:
        self._cell, self._clearance = cell, clearance
        self._names = sorted(cell.arm_names, key=lambda name: (len(candidates[name]), cell.arm_index(name)))
        self._rows = [np.ascontiguousarray(candidates[name]) for name in self._names]
        self._known: dict[tuple[int, int, int, int], bool] = {}
        self._tried = 0

    def first(self) -> dict[str, int] | None:
        """Returns arm name -> index of its candidate in a combination that is free and cheap, or None."""
        self._tried = 0
        found = self._extend([])
        return None if found is None else dict(zip(self._names, self._cheaper(found), strict=True))

    def blocked_pair(self) -> BlockedPair | None:
        """Returns the first two arms of which no two candidates are free together, or None."""
        for a, rows_a in enumerate(self._rows):
            for b, rows_b in enumerate(self._rows[:a]):
                gaps = self._cell.collision.pair_clearance(
                    self._names[a],
                    np.repeat(rows_a, len(rows_b), axis=0),
                    self._names[b],
                    np.tile(rows_b, (len(rows_a), 1)),
                )
                if gaps.max() < self._clearance:
                    i, j = divmod(int(gaps.argmax()), len(rows_b))
                    return BlockedPair(names=(self._names[b], self._names[a]), best=(j, i))
        return None

    def _extend(self, choice: list[int]) -> list[int] | None:
        """Returns the choice of the first arms with candidates of all others, or None."""
        a = len(choice)
        if a == len(self._rows):
            return choice
        for i in range(len(self._rows[a])):
            if self._tried >= MOST_TRIED:
                return None
            self._tried += 1
            if self._fits(a, i, choice) and (complete := self._extend([*choice, i])):
                return complete
        return None

    def _cheaper(self, choice: list[int]) -> list[int]:
        """Returns the choice after arms have changed to candidates that they prefer, while any can."""
        for _ in range(_SWEEPS):
            before = list(choice)
            for a, mine in enumerate(choice):
                others = [*choice[:a], -1, *choice[a + 1 :]]
                choice[a] = next((i for i in range(mine) if self._fits(a, i, others)), mine)
            if choice == before:
                break
        return choice

    def _fits(self, a: int, i: int, choice: Sequence[int]) -> bool:
        return all(b == a or self._fit(a, i, b, j) for b, j in enumerate(choice))

    def _fit(self, a: int, i: int, b: int, j: int) -> bool:
        key = (a, i, b, j) if a < b else (b, j, a, i)
        if key not in self._known:
            rows = self._rows[a][i : i + 1], self._rows[b][j : j + 1]
            gap = self._cell.collision.pair_clearance(self._names[a], rows[0], self._names[b], rows[1])
            self._known[key] = bool(gap[0] >= self._clearance)
        return self._known[key]
