"""Links that a tool may overlap with: only those that it overlaps with in each of very many configurations."""

from dataclasses import replace

import numpy as np

from mmp_env.model.robot import Spheres
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.model.tool_pairs import _links_in_tool, _overlapping


def test_a_link_that_is_free_in_one_of_a_thousand_configurations_is_tested():
    robot, tool = load_robot("ur5e"), load_tool("franka-hand")
    q = np.random.default_rng(7).uniform(robot.draw_lower, robot.draw_upper, (4000, robot.dof))
    theirs = robot.spheres["28"]
    link = int(theirs.links[0])
    pose = _links_in_tool(tool, robot, q)[link]
    own = theirs.links == link
    centers = pose[:, :3, :3] @ theirs.centers[own].T + pose[:, :3, 3, None]
    reach = (np.linalg.norm(centers, axis=1) - theirs.radii[own]).min(axis=1)

    def ignored(radius):
        ball = Spheres(links=np.zeros(1, int), centers=np.zeros((1, 3)), radii=np.array([radius]))
        return _overlapping(replace(tool, spheres={"28": ball}), robot, "28")

    assert robot.link_names[link] not in ignored(float(np.quantile(reach, 0.999)))
    assert robot.link_names[link] in ignored(10.0)
