"""Pairs of parts that must keep apart, and how far their points deviate from straight lines during a step.

While the joints go straight and move by dq, a point c(s), s in [0, 1], has |c''| <= M with
M = sum_jk |dq_j| |dq_k| reach(max(j, k)) over all pairs whose inner joint is a hinge. So it deviates from the chord
between its ends by M / 8 at most (docs/explanation/checking.md has the derivation); where the joints bend off by e, by
sum_k |e_k| reach(k) more. Two parts of one arm are compared in the frame of the inner one, where only the joints
between them count.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    joints = parts.moves.sum(axis=1)
    first, second = np.triu_indices(len(parts.links), 1)
    inner = parts.arm[first] == parts.arm[second]
    kept = ~inner & ((joints[first] > 0) | (joints[second] > 0))
    for k in np.flatnonzero(inner):
        links = frozenset((parts.links[first[k]], parts.links[second[k]]))
        kept[k] = len(links) == 2 and links not in ignored[parts.arm[first[k]]]
    turned = inner & (joints[first] > joints[second])
    first, second = np.where(turned, second, first), np.where(turned, first, second)
    return Pairs(first=first, second=second, inner=inner)[kept]


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
    """Bounds [m] on how far the points of bodies deviate from their chords in a step, a row for each body.

    Only the joints of its own arm move a body, so the rows of all arrays have a column for each joint of one arm.
    """

    def __init__(
        self,
        model: CellModel,
        arm: Int[np.ndarray, "r"],
        reach: Float[np.ndarray, "r n"],
        common: Bool[np.ndarray, "r n"] | None = None,
    ) -> None:
        """Args:
        arm: the arm of each row.
        reach: how far each joint moves the body per unit (`RigidParts.reach`).
        common: the joints that move both parts of an inner pair.
        """
        dof = np.array([arm.dof for arm in model.cell.arms])
        joint = np.arange(dof.max())
        self._mine = joint < dof[:, None]
        self._columns = np.where(self._mine, (np.cumsum(dof) - dof)[:, None] + joint, 0)
        self._turns = (self._mine & ~model.slides[self._columns]).astype(float)
        self._arm = arm
        mine, rows, columns = self._mine[arm], np.arange(len(arm))[:, None], self._columns[arm]
        shared = np.zeros(mine.shape, dtype=bool) if common is None else common[rows, columns]
        self._reach = np.where(mine & ~shared, reach[rows, columns], 0.0)
        self._common = (mine & shared) * self._turns[arm]

    def all(self, steps: MotionSteps) -> Float[np.ndarray, "u r"]:
        """Returns the bounds of all rows in all steps [m]."""
        move, bound = (values[:, self._arm] for values in self._motion(steps))
        shared = np.einsum("urk,rk->ur", move, self._common)
        return np.einsum("urk,rk->ur", bound - shared[:, :, None] * move / 4.0, self._reach)

    def each(self, steps: MotionSteps, step: Int[np.ndarray, "i"], row: Int[np.ndarray, "i"]) -> Float[np.ndarray, "i"]:
        """Returns the bound [m] of each row in its step."""
        move, bound = (values[step, self._arm[row]] for values in self._motion(steps))
        shared = np.einsum("ik,ik->i", move, self._common[row])
        return np.einsum("ik,ik->i", bound - shared[:, None] * move / 4.0, self._reach[row])

    def _motion(self, steps: MotionSteps) -> tuple[Float[np.ndarray, "u a k"], Float[np.ndarray, "u a k"]]:
        """Returns the move of each arm's joints, and what multiplies their reach where no joint is common.

        The latter is an eighth of the weight in the sum over j and k, |dq_k| (|dq_k| + 2 sum_{j < k} |dq_j|), and the
        bend. Slides count among the k alone, and without the |dq_k|^2.
        """
        move, bend = (np.where(self._mine, values[:, self._columns], 0.0) for values in (steps.move, steps.bend))
        turn = move * self._turns
        before = np.zeros_like(turn)
        np.cumsum(turn[:, :, :-1], axis=2, out=before[:, :, 1:])
        return move, move * (turn + 2.0 * before) / 8.0 + bend
