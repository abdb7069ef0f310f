"""Bounds of an arm: how far its joints can move a point of it, and how far it reaches."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.held import covering_spheres
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


def farthest_point(arm: Arm, sphere_set: str) -> float:
    """Returns an upper bound of the distance [m] of any point of the arm from the base frame: its stretched chain."""
    robot, reach, out = arm.robot, 0.0, 0.0
    spheres, tool = robot.spheres[sphere_set], arm.tool
    for link in range(robot.dof + 1):
        if link > 0:
            reach += float(np.linalg.norm(robot.origins[link - 1][:3, 3]))
            reach += max(abs(robot.lower[link - 1]), abs(robot.upper[link - 1])) if robot.slides[link - 1] else 0.0
        mine = spheres.links == link
        out = max(out, reach + _extent(spheres.centers[mine], spheres.radii[mine]))
    reach += float(np.linalg.norm(robot.flange[:3, 3]))
    if tool is not None:
        reach += float(np.linalg.norm(tool.mount[:3, 3]))
        out = max(out, reach + _extent(tool.spheres[sphere_set].centers, tool.spheres[sphere_set].radii))
    if arm.held is not None:
        out = max(out, reach + _extent(*covering_spheres(arm.held)))
    return out


def _extent(centers: Float[np.ndarray, "n 3"], radii: Float[np.ndarray, " n"]) -> float:
    """Returns the distance [m] of the farthest point of spheres from the origin."""
    return float((np.linalg.norm(centers, axis=1) + radii).max(initial=0.0))
