"""Closed forms for arms of six hinges or more: finds the special geometry, and solves for many poses at once.

Joints beyond six are locked at a grid of values. A closed form exists where the last three of the six other axes meet,
or where the second to the fourth are parallel and the fifth and the sixth meet, seen from the base or from the tool.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import SerialChain, rotation_about
from mmp_env.ik.numeric import even_points
from mmp_env.ik.six_hinges import Samples, meeting_point
from mmp_env.ik.tool_task import ToolTask
from mmp_env.ik.turns import JointBox

_HINGES = 6
_MOST_LOCKED = 3
_PROBES = 5
"""Number of configurations at which the geometry of a chain is examined."""
NEARLY = 0.01
"""Largest distance [arm lengths] of axes that meet, and largest sine of the angle of parallel ones.

Refinement makes the results exact where the geometry holds nearly, as in calibrated models.
"""


class _Grid(NamedTuple):
    """Values of the locked joints, the chains with them, and T_tool_last: the last frame seen from the tool."""

    values: Float[np.ndarray, "m locked"]
    samples: Samples
    tools: Float[np.ndarray, "m 4 4"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedForm:
    """The closed form of a chain.

    Attributes:
        chain: the arm.
        locked: joints that are locked at values of a grid.
        lower: lower corner of that grid [rad or m].
        upper: upper corner of that grid [rad or m].
        reverse: whether the special geometry is seen from the tool.
        spherical: whether three axes meet; otherwise three are parallel.
    """

    chain: SerialChain
    locked: tuple[int, ...]
    lower: Float[np.ndarray, "locked"]
    upper: Float[np.ndarray, "locked"]
    reverse: bool
    spherical: bool

    def solve(
        self, poses: Float[np.ndarray, "m 4 4"], steps: int
    ) -> tuple[Float[np.ndarray, "n dof"], Int[np.ndarray, "n"]]:
        """Returns configurations [rad or m] near solutions, and the index of the pose of each.

        Args:
            poses: of the tool frame in the base frame.
            steps: number of values of each locked joint.
        """
        if steps not in self._grids:
            self._grids[steps] = self._grid(steps)
        grid = self._grids[steps]
        targets = poses[:, None] @ grid.tools
        if self.reverse:
            targets = np.linalg.inv(targets)
        owner, value = np.divmod(np.arange(len(poses) * len(grid.values)), len(grid.values))
        samples = Samples(*(part[value] for part in grid.samples))
        angles, rows = samples.solved(targets.reshape(-1, 4, 4), self.spherical)
        q = np.empty((len(angles), self.chain.dof))
        q[:, self._free] = angles[:, ::-1] if self.reverse else angles
        q[:, list(self.locked)] = grid.values[value[rows]]
        return q, owner[rows]

    @cached_property
    def _grids(self) -> dict[int, _Grid]:
        return {}

    @cached_property
    def _free(self) -> list[int]:
        return [k for k in range(self.chain.dof) if k not in self.locked]

    def _grid(self, steps: int) -> _Grid:
        values = self.lower + (_cells(steps, len(self.locked)) + 0.5) / steps * (self.upper - self.lower)
        samples, rotations = with_locked(self.chain, self.locked, values)
        tools = np.tile(np.eye(4), (len(values), 1, 1))
        tools[:, :3, :3] = rotations.transpose(0, 2, 1)
        return _Grid(values, samples.reversed() if self.reverse else samples, tools)


def find_closed_forms(chain: SerialChain, box: JointBox) -> list[ClosedForm]:
    """Returns the closed forms of a chain, one for each choice of locked joints.

    The first lock the joints that move most in self-motions. There are none for many chains.
    """
    extra = chain.dof - _HINGES
    if not 0 <= extra <= _MOST_LOCKED or chain.slides.sum() > extra:
        return []
    lower, upper = box.one_turn()
    probes = lower + even_points(_PROBES, chain.dof) * (upper - lower)
    share, forms = _shares_of_self_motion(chain, probes), []
    for locked in map(list, itertools.combinations(range(chain.dof), extra)):
        samples, _ = with_locked(chain, tuple(locked), probes[:, locked])
        found = [_geometry_of(samples, chain.length), _geometry_of(samples.reversed(), chain.length)]
        if set(np.flatnonzero(chain.slides)) - set(locked) or found == [None, None]:
            continue
        reverse = found[0] is None
        corners = {"lower": lower[locked], "upper": upper[locked]}
        form = ClosedForm(chain=chain, locked=tuple(locked), reverse=reverse, spherical=bool(found[reverse]), **corners)
        forms.append((-float(share[locked].sum()), tuple(locked), form))
    return [form for *_, form in sorted(forms, key=lambda each: each[:2])]


def with_locked(
    chain: SerialChain, locked: tuple[int, ...], values: Float[np.ndarray, "m locked"]
) -> tuple[Samples, Float[np.ndarray, "m 3 3"]]:
    """Returns the chains whose joints are locked at values, and their tools' rotations at zero."""
    count, free = len(values), chain.dof - len(locked)
    axes, offsets = np.empty((count, free, 3)), np.empty((count, free + 1, 3))
    turn, offset, place = np.tile(np.eye(3), (count, 1, 1)), np.tile(chain.offsets[0], (count, 1)), 0
    for k, axis in enumerate(chain.axes):
        if k not in locked:
            axes[:, place], offsets[:, place] = turn @ axis, offset
            place, offset = place + 1, np.zeros((count, 3))
        elif chain.slides[k]:
            offset = offset + (turn @ axis) * values[:, locked.index(k), None]
        else:
            turn = turn @ rotation_about(axis, values[:, locked.index(k)])
        offset = offset + turn @ chain.offsets[k + 1]
    offsets[:, place] = offset
    return Samples(axes, offsets), turn @ chain.tool


def _geometry_of(samples: Samples, length: float) -> bool | None:
    """Returns True if the last three axes meet, False if three are parallel and two meet, and None otherwise."""
    h, points = samples.axes, samples.points
    across = np.linalg.norm(np.cross(h[:, :-1], h[:, 1:]), axis=2)
    if across[:, 3:].min() > NEARLY and _miss(points[:, 3:6], h[:, 3:6]) < NEARLY * length:
        return True
    parallel = max(across[:, 1:3].max(), np.linalg.norm(np.cross(h[:, 1], h[:, 3]), axis=1).max()) < NEARLY
    bent = min(across[:, 0].min(), across[:, 3:].min()) > NEARLY
    if parallel and bent and _miss(points[:, 4:6], h[:, 4:6]) < NEARLY * length:
        return False
    return None


def _miss(points: Float[np.ndarray, "m k 3"], axes: Float[np.ndarray, "m k 3"]) -> float:
    """Returns the largest distance [m] of lines from the point that is nearest to all of them."""
    away = meeting_point(points, axes)[:, None] - points
    return float(np.linalg.norm(np.cross(away, axes), axis=2).max())


def _shares_of_self_motion(chain: SerialChain, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "dof"]:
    """Returns the mean motion of each joint in motions that do not move the tool, which have length 1."""
    slope = ToolTask(chain=chain, free=None).slope(chain.frames(q))
    rest = np.linalg.svd(slope)[2][:, slope.shape[1] :]
    return np.sqrt((rest**2).sum(axis=1)).mean(axis=0)


def _cells(steps: int, dimension: int) -> Int[np.ndarray, "n dimension"]:
    return np.array(list(itertools.product(range(steps), repeat=dimension)), dtype=int).reshape(
        steps**dimension, dimension
    )
