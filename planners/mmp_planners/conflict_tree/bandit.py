"""Multi-armed bandits: which of several choices pays off at the moment."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class Bandit(Protocol):
    """Draws a choice, and learns its outcome."""

    def draw(self) -> int: ...

    def learn(self, choice: int, won: bool) -> None: ...


class DynamicThompsonSampling:
    """Dynamic Thompson Sampling (Gupta, Granmo, Agrawala, ICMLA 2011).

    Each choice has a distribution Beta(alpha, beta). The choice with the largest sample is drawn, and its outcome
    counts as a success or a failure. alpha + beta is `memory` at most; from then on older outcomes weigh less.
    """

    def __init__(
        self, choices: int, random: np.random.Generator, *, alpha: float = 1.0, beta: float = 2.0, memory: float = 10.0
    ) -> None:
        self.alpha, self.beta = np.full(choices, alpha), np.full(choices, beta)
        self._random, self._memory = random, memory

    def draw(self) -> int:
        """Returns the choice with the largest sample."""
        return int(np.argmax(self._random.beta(self.alpha, self.beta)))

    def learn(self, choice: int, won: bool) -> None:
        """Counts the outcome of a choice."""
        alpha, beta = self.alpha[choice] + won, self.beta[choice] + (not won)
        fade = min(1.0, self._memory / (alpha + beta))
        self.alpha[choice], self.beta[choice] = alpha * fade, beta * fade
