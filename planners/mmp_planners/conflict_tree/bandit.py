"""Which of several ways pays off at the moment."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class Bandit(Protocol):
    """Draws a way, and learns what came of it."""

    def draw(self) -> int: ...

    def learn(self, way: int, won: bool) -> None: ...


class DynamicThompsonSampling:
    """Dynamic Thompson Sampling (Gupta, Granmo, Agrawala 2011).

    A Beta(alpha, beta) for each way: the way with the largest sample is drawn, and its outcome counts as a success or a
    failure. alpha + beta is `memory` at most; from then on what is older weighs less with each outcome.
    """

    def __init__(
        self, ways: int, random: np.random.Generator, *, alpha: float = 1.0, beta: float = 2.0, memory: float = 10.0
    ) -> None:
        self.alpha, self.beta = np.full(ways, alpha), np.full(ways, beta)
        self._random, self._memory = random, memory

    def draw(self) -> int:
        """The way to go."""
        return int(np.argmax(self._random.beta(self.alpha, self.beta)))

    def learn(self, way: int, won: bool) -> None:
        """What came of it."""
        alpha, beta = self.alpha[way] + won, self.beta[way] + (not won)
        fade = min(1.0, self._memory / (alpha + beta))
        self.alpha[way], self.beta[way] = alpha * fade, beta * fade
