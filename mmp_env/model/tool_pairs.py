"""Links that a tool may overlap with, decided for the robot that carries it.

A built-in tool names these links. A tool that `mmp tool add` made gets those whose spheres overlap with its own in
each of 10,000 configurations. The last link carries the tool, and so it is always among them.
"""

from __future__ import annotations

import functools
import json
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from mmp_env.model.description import TOOL_FILE
from mmp_env.model.robot import Robot, Spheres, Tool

SAMPLES, _BATCH = 10_000, 250
"""Number of configurations that are tried, and of those of a batch: most candidates drop out in the first."""
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
    mine, theirs = tool.spheres[sphere_set], robot.spheres[sphere_set]
    links = [link for link in range(len(robot.link_names) - 1) if (theirs.links == link).any()]
    random = np.random.default_rng(0)
    for _ in range(SAMPLES // _BATCH):
        if not links:
            break
        poses = _links_in_tool(tool, robot, random.uniform(robot.draw_lower, robot.draw_upper, (_BATCH, robot.dof)))
        links = [link for link in links if _always_overlap(mine, theirs, link, poses[link])]
    return frozenset([robot.link_names[-1], *(robot.link_names[link] for link in links)])


def _always_overlap(mine: Spheres, theirs: Spheres, link: int, in_tool: Float[np.ndarray, "n 4 4"]) -> bool:
    """Whether spheres of the tool and of a link overlap in all these poses of the link."""
    own = theirs.links == link
    theirs_centers, theirs_radii = theirs.centers[own], theirs.radii[own]
    while len(in_tool):  # the deepest pair of one pose overlaps in most of the others
        centers = theirs_centers @ in_tool[0, :3, :3].T + in_tool[0, :3, 3]
        apart = np.linalg.norm(centers[:, None] - mine.centers, axis=-1) - theirs_radii[:, None] - mine.radii
        i, j = np.unravel_index(np.argmin(apart), apart.shape)
        if apart[i, j] >= 0:
            return False
        center = in_tool[1:, :3, :3] @ theirs_centers[i] + in_tool[1:, :3, 3]
        free = np.linalg.norm(center - mine.centers[j], axis=-1) >= theirs_radii[i] + mine.radii[j]
        in_tool = in_tool[1:][free]
    return True


def _links_in_tool(tool: Tool, robot: Robot, q: Float[np.ndarray, "n dof"]) -> list[Float[np.ndarray, "n 4 4"]]:
    """Returns the pose of each link in the tool's frame in configurations."""
    poses = [np.tile(np.eye(4), (len(q), 1, 1))]
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
