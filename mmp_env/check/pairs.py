"""Pairs of parts that must keep apart, and how far their points deviate from straight lines during a step.

While the joints go straight and move by dq, a point c(s), s in [0, 1], has |c''| <= M with
M = sum_jk |dq_j| |dq_k| reach(max(j, k)) over all pairs whose inner joint is a hinge. So it deviates from the chord
between its ends by M / 8 at most (docs/explanation/checking.md has the derivation); where the joints bend off by e, by
sum_k |e_k| reach(k) more. Two parts of one arm are compared in the frame of the inner one, where only the joints
between them count.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.checked import CheckedArm, CheckedCell
from mmp_env.check.held import BODY, holders
from mmp_env.check.items import MotionSteps
from mmp_env.check.model import CellModel, RigidParts
from mmp_env.check.models import CheckedModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """Parts `first` [p] against parts `second` [p], by index.

    Both parts of an `inner` [p] pair belong to one arm; they are compared in the frame of `first`.
    """

    first: Int[np.ndarray, "p"]
    second: Int[np.ndarray, "p"]
    inner: Bool[np.ndarray, "p"]

    def __len__(self) -> int:
        return len(self.first)

    def __getitem__(self, chosen: Bool[np.ndarray, "p"]) -> Pairs:
        return Pairs(first=self.first[chosen], second=self.second[chosen], inner=self.inner[chosen])

    @property
    def by_rule(self) -> tuple[Pairs, Pairs]:
        """The pairs of different arms, and the pairs within one arm."""
        return self[~self.inner], self[self.inner]


def part_pairs(cell: CheckedCell, parts: RigidParts) -> Pairs:
    """Returns the pairs that must keep apart.

    These are parts of different arms unless both are bases, and parts on different links of one arm unless its data say
    that they may overlap.
    """
    ignored = [ignored_links(arm, cell.spheres) for arm in cell.arms]
    rows = []
    joints = parts.moves.sum(axis=1)
    for i, j in combinations(range(len(parts.links)), 2):
        if parts.arm[i] != parts.arm[j]:
            if joints[i] or joints[j]:
                rows.append((i, j, False))
        elif len(links := frozenset((parts.links[i], parts.links[j]))) == 2 and links not in ignored[parts.arm[i]]:
            rows.append((i, j, True) if joints[i] <= joints[j] else (j, i, True))
    table = np.array(rows, dtype=int).reshape(-1, 3)
    return Pairs(first=table[:, 0], second=table[:, 1], inner=table[:, 2].astype(bool))


def ignored_links(arm: CheckedArm, spheres: str) -> set[frozenset[str]]:
    """Returns the pairs of links, tool and held object that may overlap with a sphere set."""
    out = {frozenset(pair) for pair in _of_set(arm.robot, spheres)}
    if arm.tool:
        carried_by = arm.robot.links[-1]
        out |= {frozenset((arm.tool.name, link)) for link in (*_of_set(arm.tool, spheres), carried_by)}
    if arm.held:
        out |= {frozenset((BODY, link)) for link in holders(arm)}
    return out


def _of_set(model: CheckedModel, spheres: str) -> Any:
    """Returns what a robot or tool ignores with a sphere set; for hulls without a list of their own that of `fine`."""
    ignored = model.data["self_collision_ignore"]
    return ignored["fine" if spheres == "exact" and spheres not in ignored else spheres]


class ChordDeviation:
    """Bounds [m] on how far the points of both parts of a pair together deviate from their chords in a step."""

    def __init__(
        self, model: CellModel, reach: Float[np.ndarray, "p n"], common: Bool[np.ndarray, "p n"] | None = None
    ) -> None:
        """Args:
        reach: sum over both parts of how far each joint moves them per unit (`RigidParts.reach`).
        common: the joints that move both parts of an inner pair.
        """
        arm = np.repeat(np.arange(len(model.cell.arms)), [arm.dof for arm in model.cell.arms])
        joint = np.arange(len(arm))
        self._turns = (~model.slides).astype(float)
        self._before = ((arm[:, None] == arm) & (joint[:, None] < joint) & ~model.slides[:, None]).astype(float)
        common = np.zeros(reach.shape, dtype=bool) if common is None else common
        self._reach = np.where(common, 0.0, reach)
        self._common = common * self._turns

    def all(self, steps: MotionSteps) -> Float[np.ndarray, "u p"]:
        """Returns the bounds of all pairs in all steps [m]."""
        move, reach = steps.move, self._reach.T
        shared = move @ self._common.T
        return (self._weight(move) @ reach - 2.0 * shared * (move @ reach)) / 8.0 + steps.bend @ reach

    def each(
        self, steps: MotionSteps, step: Int[np.ndarray, "i"], pair: Int[np.ndarray, "i"]
    ) -> Float[np.ndarray, "i"]:
        """Returns the bound [m] of each pair in its step."""
        move, reach = steps.move[step], self._reach[pair]
        shared = np.einsum("in,in->i", move, self._common[pair])
        weight = self._weight(steps.move)[step] - 2.0 * shared[:, None] * move
        return np.einsum("in,in->i", weight / 8.0 + steps.bend[step], reach)

    def _weight(self, move: Float[np.ndarray, "u n"]) -> Float[np.ndarray, "u n"]:
        """Returns the weight of each joint's reach in the sum over j and k: |dq_k| (|dq_k| + 2 sum_{j < k} |dq_j|).

        Slides count among the k alone, and without the |dq_k|^2.
        """
        return move * (move * self._turns + 2.0 * move @ self._before)
