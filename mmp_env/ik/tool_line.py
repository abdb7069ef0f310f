"""Straight lines of a tool: the pose moves evenly from one to another, and an arm follows it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import SerialChain
from mmp_env.ik.refinement import refined
from mmp_env.ik.tool_task import ToolTask, rotation_vector
from mmp_env.ik.turns import JointBox

_LONGEST = 0.05
"""Longest step along a line: share of the line."""
_SHORTEST = 1e-6
"""Shortest step; where an arm needs a shorter one, it cannot follow the line."""
_SHRINK, _GROW, _AIM = 0.5, 1.5, 0.8
"""Factors of a step after a failure and a success; share of the tolerance that the next step aims at."""
_REFINEMENTS = 12
_BAND, _PULL = 0.3, 0.05
"""Distance [rad or m] from a limit in which a joint of a redundant arm is pulled back; its share in a long step."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolLine:
    """A motion of a tool frame: its origin moves along a line, and it turns about one axis, both evenly.

    Attributes:
        begin: first pose [4, 4] in the base frame of the arm.
        end: last pose. It is turned by less than half a turn.
    """

    begin: Float[np.ndarray, "4 4"]
    end: Float[np.ndarray, "4 4"]

    @cached_property
    def turn(self) -> Float[np.ndarray, "3"]:
        """Axis of the rotation in the first tool frame times its angle [rad]."""
        return rotation_vector((self.begin[:3, :3].T @ self.end[:3, :3])[None])[0]

    def at(self, share: float) -> Float[np.ndarray, "4 4"]:
        """Returns the pose after a share of the line."""
        if share == 1.0:
            return self.end
        out = np.array(self.begin)
        out[:3, :3] = self.begin[:3, :3] @ _rotation(share * self.turn)
        out[:3, 3] += share * (self.end[:3, 3] - self.begin[:3, 3])
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class FollowedLine:
    """How far an arm follows a line.

    Attributes:
        shares: ascending from 0: shares of the line at the configurations.
        q: configurations [n, dof] [rad or m].
        beyond: joint that leaves its limits next; -1 if none does.
    """

    shares: Float[np.ndarray, "n"]
    q: Float[np.ndarray, "n dof"]
    beyond: int = -1

    @property
    def whole(self) -> bool:
        """Whether the arm follows the whole line."""
        return bool(self.shares[-1] == 1.0)


def follow(
    chain: SerialChain, box: JointBox, q: Float[np.ndarray, "dof"], line: ToolLine, tolerance: float
) -> FollowedLine:
    """Returns configurations along a line. The joints move evenly between two of them.

    The tool is on the line at each configuration, and within the tolerance at every instant between two (`off_line`).

    Args:
        chain: the arm.
        box: its joint limits.
        q: configuration at the begin of the line [rad or m].
        line: what the tool does.
        tolerance: largest distance of the tool from the line [m], and of its rotation [rad].
    """
    task, shares, rows = ToolTask(chain=chain, free=None), [0.0], [q]
    step, beyond = _LONGEST, -1
    while shares[-1] < 1.0 and step >= _SHORTEST:
        share = min(1.0, shares[-1] + step)
        found, _ = refined(task, _pulled(box, rows[-1], step)[None], line.at(share)[None], steps=_REFINEMENTS)
        off = off_line(chain, box, found[0] - rows[-1]) if len(found) else np.inf
        outside = np.maximum(box.lower - found[0], found[0] - box.upper) if len(found) else np.zeros(1)
        if off > tolerance or outside.max() > 0:
            beyond = int(outside.argmax()) if off <= tolerance else -1
            step *= _SHRINK
            continue
        shares.append(share)
        rows.append(found[0])
        step = min(_LONGEST, step * min(_GROW, np.sqrt(_AIM * tolerance / max(off, 1e-12))))
    return FollowedLine(shares=np.array(shares), q=np.array(rows), beyond=-1 if shares[-1] == 1.0 else beyond)


def _pulled(box: JointBox, q: Float[np.ndarray, "dof"], step: float) -> Float[np.ndarray, "dof"]:
    """Returns a configuration with joints of a redundant arm pulled away from their limits.

    The refinement moves the joints as little as brings the tool back, so only their self-motion remains.
    """
    if len(q) <= 6:
        return q
    band = np.minimum(_BAND, (box.upper - box.lower) / 4)
    pull = _PULL * step / _LONGEST
    return q + pull * (np.maximum(box.lower + band - q, 0) - np.maximum(q - box.upper + band, 0))


def off_line(chain: SerialChain, box: JointBox, motion: Float[np.ndarray, "dof"]) -> float:
    """Returns an upper bound of the distance of a tool from the line between the ends of an even joint motion.

    A function of an interval is at most an eighth of its largest second derivative from its chord. That of the position
    is at most (sum of hinges)^2 times the reach of the arm, and 2 (sum of hinges) (sum of slides); that of the rotation
    is at most (sum of hinges)^2. The bound is the larger of both, in m and rad.

    Args:
        chain: the arm.
        box: its joint limits; the travel of slides adds to the reach.
        motion: motion of each joint [rad or m].
    """
    hinges = float(np.abs(motion[~chain.slides]).sum())
    slides = float(np.abs(motion[chain.slides]).sum())
    reach = chain.length + np.maximum(np.abs(box.lower), np.abs(box.upper))[chain.slides].sum()
    return hinges * (hinges * max(1.0, float(reach)) + 2 * slides) / 8


def _rotation(vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Returns the rotation about a vector by its length [rad] (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / max(angle, 1e-300)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
