"""Bounds of how far the joints of an arm can move a point of it."""

from __future__ import annotations

import functools

import numpy as np
from jaxtyping import Float, Int

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


@functools.lru_cache(maxsize=64)
def _lipschitz(robot: Robot, tool: Tool | None, sphere_set: str) -> float:
    spheres = robot.spheres[sphere_set]
    links, centers = spheres.links, spheres.centers
    if tool is not None:
        on_flange = robot.flange @ tool.mount
        on_tool = tool.spheres[sphere_set].centers @ on_flange[:3, :3].T + on_flange[:3, 3]
        links, centers = np.append(links, np.full(len(on_tool), robot.dof)), np.concatenate([centers, on_tool])
    return float(np.sum([_moves_by(robot, joint, links, centers) for joint in range(robot.dof)], axis=0).max())


def _moves_by(
    robot: Robot, joint: int, links: Int[np.ndarray, "n"], centers: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n"]:
    """Returns bounds [m] on the distances of points on links (in the links' joint frames) from a hinge's axis.

    Returns 1 for each point behind a slide. A point on a link before the joint does not move: 0.
    """
    if robot.slides[joint]:
        return np.where(links > joint, 1.0, 0.0)
    axis = robot.axes[joint] / np.linalg.norm(robot.axes[joint])
    farther = np.maximum(np.abs(robot.lower), np.abs(robot.upper)) * robot.slides
    # From the joint to the origin of each link, and from there to the points.
    out = np.where(links == joint + 1, _off_axis(centers, axis), 0.0)
    if joint + 1 < robot.dof:
        pieces = np.linalg.norm(robot.origins[:, :3, 3], axis=1)[: robot.dof]
        pieces[joint + 1] = _off_axis(robot.origins[joint + 1, None, :3, 3], axis)[0]
        chain = np.cumsum((pieces + farther)[joint + 1 :])
        behind = links > joint + 1
        out[behind] = chain[links[behind] - joint - 2] + np.linalg.norm(centers[behind], axis=1)
    return out


def _off_axis(points: Float[np.ndarray, "n 3"], axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n"]:
    """Returns the distances of points from the line through the origin along an axis of length 1."""
    return np.linalg.norm(points - (points @ axis)[:, None] * axis, axis=1)
