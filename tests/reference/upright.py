"""Angle between a tool axis and the world's z axis, one configuration at a time."""

import numpy as np

from reference import kinematics


def tilt(arm, axis, q):
    """Returns the angle [rad] between an axis of the tool frame, or of the flange's without a tool, and z."""
    frame = kinematics.flange_frame(arm, q) if arm.tool is None else kinematics.link_frames(arm, q)[-1]
    turned = frame[:3, :3] @ (np.asarray(axis) / np.linalg.norm(axis))
    return np.arctan2(np.linalg.norm(np.cross(turned, [0, 0, 1])), turned[2])
