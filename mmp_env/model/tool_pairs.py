"""Links that a tool may overlap with, decided for the robot that carries it.

A built-in tool names these links. A tool that `mmp tool add` made gets those whose spheres overlap with its own in
each of many configurations. The last link carries the tool, and so it is always among them.
"""

from __future__ import annotations

import functools
import json
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from mmp_env.model.description import TOOL_FILE
from mmp_env.model.robot import Robot, Tool

SAMPLES = 200
"""Number of configurations that are tried."""
_BY_ROBOT = "self_pairs"


@functools.lru_cache(maxsize=256)
def fitted_tool(tool: Tool, robot: Robot) -> Tool:
    """Returns the tool with the links of this robot that it may overlap with. Its files name them too."""
    data = json.loads(tool.files.get(TOOL_FILE, "{}"))
    if data.pop(_BY_ROBOT, None) is None:
        return tool
    ignored = {key: _overlapping(tool, robot, key) for key in tool.self_ignore if key in robot.spheres}
    data["self_collision_ignore"] = {key: sorted(names) for key, names in ignored.items()}
    return replace(tool, self_ignore=ignored, files={**tool.files, TOOL_FILE: json.dumps(data)})


def _overlapping(tool: Tool, robot: Robot, sphere_set: str) -> frozenset[str]:
    poses = _links_in_tool(tool, robot)
    mine, theirs = tool.spheres[sphere_set], robot.spheres[sphere_set]
    out = {robot.link_names[-1]}
    for link, in_tool in enumerate(poses[:-1]):
        own = theirs.links == link
        centers = np.einsum("nij,sj->nsi", in_tool[:, :3, :3], theirs.centers[own]) + in_tool[:, None, :3, 3]
        apart = np.linalg.norm(centers[:, :, None] - mine.centers, axis=-1) - theirs.radii[own, None] - mine.radii
        if apart.size and (apart.min(axis=(1, 2)) < 0).all():
            out.add(robot.link_names[link])
    return frozenset(out)


def _links_in_tool(tool: Tool, robot: Robot) -> list[Float[np.ndarray, "n 4 4"]]:
    """Returns the pose of each link in the tool's frame in random configurations."""
    q = np.random.default_rng(0).uniform(robot.draw_lower, robot.draw_upper, (SAMPLES, robot.dof))
    poses = [np.tile(np.eye(4), (SAMPLES, 1, 1))]
    for k in range(robot.dof):
        poses.append(poses[-1] @ robot.origins[k] @ _joint(robot.axes[k], q[:, k], slides=robot.slides[k]))
    last = np.linalg.inv(poses[-1] @ robot.flange @ tool.mount)
    return [last @ pose for pose in poses]


def _joint(axis: Float[np.ndarray, "3"], q: Float[np.ndarray, "n"], *, slides: bool) -> Float[np.ndarray, "n 4 4"]:
    out = np.tile(np.eye(4), (len(q), 1, 1))
    along = axis / np.linalg.norm(axis)
    if slides:
        out[:, :3, 3] = q[:, None] * along
        return out
    cross = np.array([[0, -along[2], along[1]], [along[2], 0, -along[0]], [-along[1], along[0], 0]])
    out[:, :3, :3] += np.sin(q)[:, None, None] * cross + (1 - np.cos(q))[:, None, None] * (cross @ cross)
    return out
