"""Bounds of how far the joints of an arm can move a point of it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.robot import Robot, Tool


def lipschitz(arm: Arm, sphere_set: str) -> float:
    """Returns L [m/rad] with |c(q') - c(q)| <= L max_j |q'_j - q_j| for every sphere centre c.

    A hinge that turns by x rad moves a point by at most x times its distance from the axis. That distance is at most
    the length of the chain from the joint to the point, origin by origin, with slides at their farther limit; the first
    piece is fixed to the joint, so only its part off the axis counts. A slide that moves by x m moves a point by x m. L
    is the largest sum of these distances over the spheres, where a slide counts 1.
    """
    return _lipschitz(arm.robot, arm.tool, sphere_set)


def _lipschitz(robot: Robot, tool: Tool | None, sphere_set: str) -> float:
    spheres = robot.spheres[sphere_set]
    points = [(int(k), center) for k, center in zip(spheres.links, spheres.centers, strict=True) if k > 0]
    if tool is not None:
        on_flange = robot.flange @ tool.mount
        centers = tool.spheres[sphere_set].centers
        points += [(robot.dof, on_flange[:3, :3] @ center + on_flange[:3, 3]) for center in centers]
    return max(sum(_moves_by(robot, joint, link, center) for joint in range(link)) for link, center in points)


def _moves_by(robot: Robot, joint: int, link: int, center: Float[np.ndarray, "3"]) -> float:
    """Returns a bound [m] on the distance of a point on `link` (in that link's joint frame) from a hinge's axis.

    Returns 1 for a slide.
    """
    if robot.slides[joint]:
        return 1.0
    pieces = [robot.origins[k][:3, 3] for k in range(joint + 1, link)] + [center]
    axis = robot.axes[joint] / np.linalg.norm(robot.axes[joint])
    off_axis = pieces[0] - (pieces[0] @ axis) * axis
    travel = sum(max(abs(robot.lower[k]), abs(robot.upper[k])) for k in range(joint + 1, link) if robot.slides[k])
    return float(np.linalg.norm(off_axis) + sum(np.linalg.norm(piece) for piece in pieces[1:]) + travel)
