"""Closed forms for arms of six hinges or more: finds the special geometry, and solves for many poses at once.

Joints beyond six are locked at a grid of values. A closed form exists where the last three of the six other axes meet,
or where the second to the fourth are parallel, seen from the base or from the tool.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import SerialChain, rotation_about
from mmp_env.ik.numeric import even_points
from mmp_env.ik.six_hinges import Samples, meeting_point, parallel_axes, spherical_wrist
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
_Method = Callable[[Samples], tuple[Float[np.ndarray, "n 6"], Int[np.ndarray, "n"]]]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedForm:
    """The closed form of a chain.

    Attributes:
        chain: the arm.
        locked: joints that are locked at values of a grid.
        lower: lower corner of that grid [rad or m].
        upper: upper corner of that grid [rad or m].
        reverse: whether the special geometry is seen from the tool.
        method: solves for the other six joints.
    """

    chain: SerialChain
    locked: tuple[int, ...]
    lower: Float[np.ndarray, "locked"]
    upper: Float[np.ndarray, "locked"]
    reverse: bool
    method: _Method

    def solve(
        self, poses: Float[np.ndarray, "m 4 4"], steps: int
    ) -> tuple[Float[np.ndarray, "n dof"], Int[np.ndarray, "n"]]:
        """Returns configurations [rad or m] near solutions, and the index of the pose of each.

        Args:
            poses: of the tool frame in the base frame.
            steps: number of values of each locked joint.
        """
        values = self.lower + (_grid(steps, len(self.locked)) + 0.5) / steps * (self.upper - self.lower)
        samples, tools = with_locked(self.chain, self.locked, values)
        owner = np.repeat(np.arange(len(poses)), len(values))
        value = np.tile(np.arange(len(values)), len(poses))
        rotation = poses[owner, :3, :3] @ tools[value].transpose(0, 2, 1)
        samples = Samples(samples.axes[value], samples.offsets[value], rotation, poses[owner, :3, 3])
        angles, rows = self.method(samples.reversed() if self.reverse else samples)
        q = np.empty((len(angles), self.chain.dof))
        q[:, [k for k in range(self.chain.dof) if k not in self.locked]] = angles[:, ::-1] if self.reverse else angles
        q[:, list(self.locked)] = values[value[rows]]
        return q, owner[rows]


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
        methods = [_method_of(samples, chain.length), _method_of(samples.reversed(), chain.length)]
        if set(np.flatnonzero(chain.slides)) - set(locked) or methods == [None, None]:
            continue
        reverse = methods[0] is None
        corners = {"lower": lower[locked], "upper": upper[locked]}
        form = ClosedForm(chain=chain, locked=tuple(locked), reverse=reverse, method=methods[reverse], **corners)
        forms.append((-float(share[locked].sum()), tuple(locked), form))
    return [form for *_, form in sorted(forms, key=lambda each: each[:2])]


def with_locked(
    chain: SerialChain, locked: tuple[int, ...], values: Float[np.ndarray, "m locked"]
) -> tuple[Samples, Float[np.ndarray, "m 3 3"]]:
    """Returns the chains whose joints are locked at values, without targets, and their tools' rotations at zero."""
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
    return Samples(axes, offsets, np.empty((count, 3, 3)), np.empty((count, 3))), turn @ chain.tool


def _method_of(samples: Samples, length: float) -> _Method | None:
    h, points = samples.axes, samples.points
    across = np.linalg.norm(np.cross(h[:, :-1], h[:, 1:]), axis=2)
    if across[:, 3:].min() > NEARLY and _miss(points[:, 3:6], h[:, 3:6]) < NEARLY * length:
        return spherical_wrist
    parallel = max(across[:, 1:3].max(), np.linalg.norm(np.cross(h[:, 1], h[:, 3]), axis=1).max()) < NEARLY
    bent = min(across[:, 0].min(), across[:, 3:].min()) > NEARLY
    if parallel and bent and _miss(points[:, 4:6], h[:, 4:6]) < NEARLY * length:
        return parallel_axes
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


def _grid(steps: int, dimension: int) -> Int[np.ndarray, "n dimension"]:
    return np.array(list(itertools.product(range(steps), repeat=dimension)), dtype=int).reshape(
        steps**dimension, dimension
    )
