"""Reference of `core.small_cover`: a greedy set cover and RWLS, in NumPy.

Gao, Weise, Li: "An efficient local search heuristic with row weighting for the unicost set covering problem" (2015).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

_TABU_STEPS = 3
_STEPS_OF_EACH = 8
"""Largest number of search steps for each chosen candidate: small covers need few."""


def small_cover(
    *,
    samples: Int[np.ndarray, "m"],
    candidates: Int[np.ndarray, "m"],
    sample_count: int,
    candidate_count: int,
    chosen: Int[np.ndarray, "k"],
    draws: Float[np.ndarray, "steps"],
) -> Int[np.ndarray, "c"]:
    """Returns few candidates that cover all samples, see `core.small_cover`."""
    cover = SetCover((samples, candidates), sample_count, candidate_count)
    cover.start(chosen)
    cover.shrink(draws)
    return cover.chosen


class SetCover:
    """Candidates [c] that each cover some samples [n], and the `chosen` ones.

    `pairs` holds the sample and the candidate of each covering [m, 2].
    """

    def __init__(self, pairs: tuple[Int[np.ndarray, "m"], Int[np.ndarray, "m"]], samples: int, candidates: int) -> None:
        self._of_sample = _Lists(pairs[0], pairs[1], samples)
        self._of_candidate = _Lists(pairs[1], pairs[0], candidates)
        self._weight = np.ones(samples)
        self._count = np.zeros(samples, dtype=int)
        self._score = np.bincount(pairs[1], minlength=candidates).astype(float)
        self._chosen = np.zeros(candidates, dtype=bool)
        self._changed = np.full(candidates, -_TABU_STEPS)
        self._coverable = np.diff(self._of_sample.begin) > 0

    @property
    def chosen(self) -> Int[np.ndarray, "k"]:
        """Numbers of the chosen candidates."""
        return np.flatnonzero(self._chosen)

    def start(self, chosen: Int[np.ndarray, "k"]) -> None:
        """Chooses candidates, and further ones greedily until all samples are covered."""
        for candidate in chosen:
            self._add(int(candidate))
        self._complete()

    def shrink(self, draws: Float[np.ndarray, "steps"]) -> None:
        """Searches for a smaller choice, and keeps the smallest that covers all samples."""
        best = self.chosen
        for step in range(min(len(draws), _STEPS_OF_EACH * len(best))):
            open_ = self._open()
            while not len(open_):
                best = self.chosen
                if len(best) <= 1:
                    return
                self._remove(self._least_loss(step))
                open_ = self._open()
            self._remove(self._least_loss(step), step)
            open_ = self._open()
            row = int(open_[int(draws[step] * len(open_))])
            choice = self._of_sample.one(row)
            allowed = choice[self._changed[choice] < step]
            choice = allowed if len(allowed) else choice
            score = self._score[choice]
            ties = choice[score >= score.max() - 1e-9]
            self._add(int(ties[self._changed[ties].argmin()]), step)
            self._make_heavier(self._open())
        if len(self._open()) or len(self.chosen) > len(best):
            self._restore(best)

    def _open(self) -> np.ndarray:
        """Samples that are not covered and could be."""
        return np.flatnonzero((self._count == 0) & self._coverable)

    def _complete(self) -> None:
        while len(self._open()):
            score = np.where(self._chosen, -1.0, self._score)
            self._add(int(score.argmax()))

    def _least_loss(self, step: int) -> int:
        chosen = self.chosen
        old = chosen[self._changed[chosen] < step - _TABU_STEPS]
        chosen = old if len(old) else chosen
        loss = self._score[chosen]
        ties = chosen[loss <= loss.min() + 1e-9]
        return int(ties[self._changed[ties].argmin()])

    def _restore(self, best: np.ndarray) -> None:
        wanted = np.zeros(len(self._chosen), dtype=bool)
        wanted[best] = True
        for candidate in np.flatnonzero(wanted & ~self._chosen):
            self._add(int(candidate))
        for candidate in np.flatnonzero(self._chosen & ~wanted):
            self._remove(int(candidate))

    def _add(self, candidate: int, step: int = -_TABU_STEPS) -> None:
        rows = self._of_candidate.one(candidate)
        count = self._count[rows]
        alone, doubled = rows[count == 0], rows[count == 1]
        self._count[rows] += 1
        self._change_scores(alone, -1.0, chosen=False)
        self._change_scores(doubled, -1.0, chosen=True)
        self._chosen[candidate], self._changed[candidate] = True, step
        self._score[candidate] = self._weight[alone].sum()

    def _remove(self, candidate: int, step: int = -_TABU_STEPS) -> None:
        rows = self._of_candidate.one(candidate)
        self._count[rows] -= 1
        count = self._count[rows]
        open_, alone = rows[count == 0], rows[count == 1]
        self._chosen[candidate], self._changed[candidate] = False, step
        self._change_scores(open_, 1.0, chosen=False)
        self._change_scores(alone, 1.0, chosen=True)
        self._score[candidate] = self._weight[open_].sum()

    def _make_heavier(self, rows: np.ndarray) -> None:
        self._weight[rows] += 1.0
        found, _ = self._of_sample.many(rows)
        self._score += np.bincount(found, minlength=len(self._score))

    def _change_scores(self, rows: np.ndarray, sign: float, *, chosen: bool) -> None:
        """Adds the weights of samples to the scores of the candidates that cover them: of the chosen or the others."""
        if not len(rows):
            return
        found, length = self._of_sample.many(rows)
        weight = np.repeat(sign * self._weight[rows], length)
        change = np.bincount(found, weight, len(self._score))
        np.add(self._score, change, out=self._score, where=self._chosen == chosen)


class _Lists:
    """For each number of `keys` the list of its values."""

    def __init__(self, keys: np.ndarray, values: np.ndarray, count: int) -> None:
        self._values: np.ndarray = values[np.argsort(keys, kind="stable")]
        self.begin = np.concatenate([[0], np.cumsum(np.bincount(keys, minlength=count))])

    def one(self, key: int) -> np.ndarray:
        """Returns the values of a key."""
        return self._values[self.begin[key] : self.begin[key + 1]]

    def many(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the values of all keys, one after another, and their numbers."""
        begin = self.begin[keys]
        length = self.begin[keys + 1] - begin
        ends = np.cumsum(length)
        total = int(ends[-1]) if len(ends) else 0
        return self._values[np.arange(total) + np.repeat(begin - ends + length, length)], length
