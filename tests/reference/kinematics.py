"""Forward kinematics of one arm, one configuration at a time, and Jacobians of its points."""

import numpy as np

from mmp_env.model.arm import Arm


def rotation_about(axis, angle):
    """Homogeneous rotation by `angle` [rad] about `axis` (Rodrigues), [4, 4]."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y, 0], [z, 0, -x, 0], [-y, x, 0, 0], [0, 0, 0, 0]])
    return np.eye(4) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def moved_by(robot, joint, position):
    """Homogeneous motion of a joint at `position` [rad or m]: about its axis, or along it, [4, 4]."""
    if not robot.slides[joint]:
        return rotation_about(robot.axes[joint], position)
    out = np.eye(4)
    out[:3, 3] = position * np.asarray(robot.axes[joint]) / np.linalg.norm(robot.axes[joint])
    return out


def base_frame(arm: Arm):
    """Returns T_world_base [4, 4]. A unit quaternion turns by twice its angle about its axis."""
    w, axis = arm.quaternion[0], arm.quaternion[1:]
    sine = np.linalg.norm(axis)
    out = rotation_about(axis, 2 * np.arctan2(sine, w)) if sine > 0 else np.eye(4)
    out[:3, 3] = arm.position
    return out


def link_frames(arm: Arm, q):
    """Returns T_world_link of every link, base first, then T_world_tool if a tool is mounted: [links, 4, 4]."""
    robot = arm.robot
    frames = [base_frame(arm)]
    for k in range(robot.dof):
        frames.append(frames[-1] @ robot.origins[k] @ moved_by(robot, k, q[k]))
    if arm.tool is not None:
        frames.append(frames[-1] @ robot.flange @ arm.tool.mount)
    return np.array(frames)


def flange_frame(arm: Arm, q):
    """Returns T_world_flange [4, 4]."""
    return link_frames(arm, q)[arm.robot.dof] @ arm.robot.flange


def tool_frame(arm: Arm, q):
    """Returns T_world_tool [4, 4], or T_world_flange where no tool is mounted."""
    return link_frames(arm, q)[-1] if arm.tool is not None else flange_frame(arm, q)


def tool_point(arm: Arm, q):
    """Returns the tool point in the world [m], or the flange's origin where no tool is mounted."""
    if arm.tool is None:
        return flange_frame(arm, q)[:3, 3]
    return (link_frames(arm, q)[-1] @ [*arm.tool.point, 1.0])[:3]


def part_names(arm: Arm):
    """Returns the name of each row of `link_frames`: the robot's links, then the tool."""
    return [*arm.robot.link_names, *([arm.tool.name] if arm.tool is not None else [])]


def moving_joints(arm: Arm, part):
    """Returns the number of joints that move the part. The tool moves with the last link."""
    return min(part, arm.robot.dof)


def point_at(arm: Arm, q, part, local):
    """Returns the world position [m] of the point `local` of a part."""
    return (link_frames(arm, q)[part] @ [*local, 1.0])[:3]


def point_jacobian(arm: Arm, q, part, local):
    """Returns d point / d q [m/rad or m/m], [3, dof]. Each joint moves points of its parts about or along its axis."""
    frames = link_frames(arm, q)
    point = (frames[part] @ [*local, 1.0])[:3]
    out = np.zeros((3, arm.dof))
    for k in range(moving_joints(arm, part)):
        joint_frame = frames[k + 1]
        axis = joint_frame[:3, :3] @ arm.robot.axes[k] / np.linalg.norm(arm.robot.axes[k])
        out[:, k] = axis if arm.robot.slides[k] else np.cross(axis, point - joint_frame[:3, 3])
    return out


def point_jacobian_by_differences(arm: Arm, q, part, local, step=1e-6):
    """Returns the same by central differences."""
    out = np.zeros((3, arm.dof))
    for k in range(arm.dof):
        ahead, behind = np.array(q, dtype=float), np.array(q, dtype=float)
        ahead[k] += step
        behind[k] -= step
        out[:, k] = (point_at(arm, ahead, part, local) - point_at(arm, behind, part, local)) / (2 * step)
    return out
