"""Dense sampling of motions: edges of one arm, and steps of two trajectories on a common grid.

Sampling cannot prove that a motion is free, so each least clearance has a slack: how much closer the bodies may come
between two samples. It follows from how far any sphere centre can move.
"""

import numpy as np

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from reference.clearance import moving_clearance, static_clearance
from reference.kinematics import moving_joints


def along(q_from, q_to, samples):
    """Returns `samples` + 1 configurations along the straight segment, with both ends."""
    return [np.asarray(q_from) + s * (np.asarray(q_to) - q_from) for s in np.linspace(0, 1, samples + 1)]


def farthest_reach(arm: Arm, sphere_set):
    """Returns an upper bound of how far each joint moves the spheres per unit.

    For a hinge it is their distance [m] from its axis in the stretched chain, slides at their limits; for a slide 1.
    """
    robot = arm.robot
    reach = np.zeros(robot.dof)
    spheres = [(link, np.linalg.norm(c)) for link, c in zip(*_local(robot.spheres[sphere_set]), strict=True)]
    if arm.tool is not None:
        to_tool = np.linalg.norm((robot.flange @ arm.tool.mount)[:3, 3])
        spheres += [(robot.dof + 1, to_tool + np.linalg.norm(c)) for c in arm.tool.spheres[sphere_set].centers]
    for joint in range(robot.dof):
        for part, from_origin in spheres:
            carried = moving_joints(arm, part)
            if carried > joint:
                links = sum(np.linalg.norm(robot.origins[k][:3, 3]) for k in range(joint + 1, carried))
                slides = [k for k in range(joint + 1, carried) if robot.slides[k]]
                travel = sum(max(abs(robot.lower[k]), abs(robot.upper[k])) for k in slides)
                reach[joint] = 1.0 if robot.slides[joint] else max(reach[joint], links + travel + from_origin)
    return reach


def travel_bound(arm: Arm, sphere_set, dq):
    """Returns the bound on the path length of any sphere centre while the joints move by `dq` [m]."""
    return float(farthest_reach(arm, sphere_set) @ np.abs(dq))


def edge_clearance(cell: Cell, arm_name, q_from, q_to, samples=200):
    """Returns the least static clearance of the samples along an edge [m]."""
    return min(static_clearance(cell, arm_name, q) for q in along(q_from, q_to, samples))


def edge_slack(cell: Cell, arm_name, q_from, q_to, samples=200):
    """Returns how far the least clearance of the whole edge may lie below that of the samples [m].

    No configuration is farther than half a sampling interval from a sample. Both links of a self pair move.
    """
    return travel_bound(cell.arm(arm_name), cell.spheres, np.subtract(q_to, q_from)) / samples


def step_clearance(cell: Cell, arm_a, a_from, a_to, arm_b, b_from, b_to, samples=50):
    """Returns the least sampled clearance [m] of the moving links of two arms during one straight step.

    Bases do not move, so the clearance of an arm from another base is a property of its edge.
    """
    both = zip(along(a_from, a_to, samples), along(b_from, b_to, samples), strict=True)
    return min(moving_clearance(cell, arm_a, qa, arm_b, qb) for qa, qb in both)


def step_slack(cell: Cell, arm_a, a_from, a_to, arm_b, b_from, b_to, samples=50):
    """Returns how far the least clearance within the step may lie below that of the samples [m]."""
    travel_a = travel_bound(cell.arm(arm_a), cell.spheres, np.subtract(a_to, a_from))
    travel_b = travel_bound(cell.arm(arm_b), cell.spheres, np.subtract(b_to, b_from))
    return (travel_a + travel_b) / (2 * samples)


def padded(path, steps):
    """Returns the path [k, dof] followed by its goal, `steps` + 1 rows in all: a finished arm stays at its goal."""
    return np.vstack([path, np.repeat(path[-1:], steps + 1 - len(path), axis=0)])


def step_clearances(cell: Cell, arm_a, path_a, arm_b, path_b, samples=50):
    """Returns (least clearance, slack) [m] of every step k..k+1 up to the end of the longer path."""
    steps = max(len(path_a), len(path_b)) - 1
    a, b = padded(np.asarray(path_a), steps), padded(np.asarray(path_b), steps)
    return [
        (
            step_clearance(cell, arm_a, a[k], a[k + 1], arm_b, b[k], b[k + 1], samples),
            step_slack(cell, arm_a, a[k], a[k + 1], arm_b, b[k], b[k + 1], samples),
        )
        for k in range(steps)
    ]


def conflicting_steps(cell: Cell, arm_a, path_a, arm_b, path_b, margin, samples=50):
    """Returns the steps k in which the two arms come closer than `margin` somewhere between k and k + 1."""
    found = step_clearances(cell, arm_a, path_a, arm_b, path_b, samples)
    return [k for k, (least, _) in enumerate(found) if least < margin]


def _local(spheres):
    return spheres.links, spheres.centers
