"""Inverse kinematics of one arm by Newton's method from random configurations, one at a time."""

import numpy as np

from reference.kinematics import flange_frame, link_frames


def tool_frame(arm, q):
    """Returns the pose of the tool frame, or of the flange without a tool, in the world [4, 4]."""
    return flange_frame(arm, q) if arm.tool is None else link_frames(arm, q)[-1]


def error(arm, q, pose):
    """Returns the position error [m] and the rotation vector [rad] from the tool frame to a pose, [6]."""
    frame = tool_frame(arm, q)
    turn = pose[:3, :3] @ frame[:3, :3].T
    vector = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = np.linalg.norm(vector)
    scale = np.arctan2(sine, (np.trace(turn) - 1) / 2) / sine if sine > 1e-12 else 1.0
    return np.concatenate([pose[:3, 3] - frame[:3, 3], scale * vector])


def slope(arm, q):
    """Returns the motion of the tool frame by each joint [m/rad and rad/rad, or m/m], [6, dof]."""
    frames, end = link_frames(arm, q), tool_frame(arm, q)[:3, 3]
    out = np.zeros((6, arm.dof))
    for k in range(arm.dof):
        axis = frames[k + 1][:3, :3] @ arm.robot.axes[k] / np.linalg.norm(arm.robot.axes[k])
        if arm.robot.slides[k]:
            out[:3, k] = axis
        else:
            out[:, k] = [*np.cross(axis, end - frames[k + 1][:3, 3]), *axis]
    return out


def solved(arm, q, pose, steps=30):
    """Returns the solution [rad or m] that Newton's method finds from `q`, or None."""
    for _ in range(steps):
        rest = error(arm, q, pose)
        if np.linalg.norm(rest) < 1e-9:
            return q
        step = np.linalg.lstsq(slope(arm, q), rest, rcond=1e-4)[0]
        q = q + step * min(1.0, 0.5 / np.abs(step).max())
    return None


def branches_by_restarts(arm, pose, restarts, rng):
    """Returns the solutions within the joint limits from random configurations, hinges turned by 2 pi where needed."""
    robot, out = arm.robot, []
    for _ in range(restarts):
        q = solved(arm, rng.uniform(robot.draw_lower, robot.draw_upper), pose)
        if q is None:
            continue
        hinges = ~np.array(robot.slides)
        q = np.where(hinges, q + np.ceil((robot.lower - q) / (2 * np.pi)) * 2 * np.pi, q)
        if (q >= robot.lower).all() and (q <= robot.upper).all():
            out.append(q)
    return out
