"""How far a joint can carry a point of an arm."""

from __future__ import annotations

import functools

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.robot import Robot, Tool


def lipschitz(arm: Arm, sphere_set: str) -> float:
    """How far any sphere centre moves at most [m] when no joint moves more than one rad, wherever the arm is.

    A joint that turns by x rad moves a point by x times its distance from the axis at most. That distance is at most
    the way to the point along the chain, from one joint's origin to the next; of the first piece, which is fixed to the
    joint, only what is off the axis counts. So L is the largest, over the spheres, of the sum of these levers, and
    |c(q') - c(q)| <= L max_j |q'_j - q_j|.
    """
    return _sum_of_levers(arm.robot, arm.tool, sphere_set)


@functools.lru_cache(maxsize=64)
def _sum_of_levers(robot: Robot, tool: Tool | None, sphere_set: str) -> float:
    spheres = robot.spheres[sphere_set]
    points = [(int(k), center) for k, center in zip(spheres.links, spheres.centers, strict=True) if k > 0]
    if tool is not None:
        on_flange = robot.flange @ tool.mount
        centers = tool.spheres[sphere_set].centers
        points += [(robot.dof, on_flange[:3, :3] @ center + on_flange[:3, 3]) for center in centers]
    return max(sum(_lever(robot, joint, link, center) for joint in range(link)) for link, center in points)


def _lever(robot: Robot, joint: int, link: int, center: Float[np.ndarray, "3"]) -> float:
    """A bound [m] on the distance of a point on `link` (in the frame of that link's joint) from the axis of a joint."""
    pieces = [robot.origins[k][:3, 3] for k in range(joint + 1, link)] + [center]
    axis = robot.axes[joint] / np.linalg.norm(robot.axes[joint])
    off_axis = pieces[0] - (pieces[0] @ axis) * axis
    return float(np.linalg.norm(off_axis) + sum(np.linalg.norm(piece) for piece in pieces[1:]))
