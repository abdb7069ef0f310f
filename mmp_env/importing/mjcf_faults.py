"""Faults of a robot's MJCF: names, limits and poses of links that differ from robot.json."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mmp_env.importing.checked_files import RobotFiles, pose_of
from mmp_env.mujoco_import import mujoco

_POSE_TOLERANCE = 1e-6
_CONFIGURATIONS = 100


def name_faults(files: RobotFiles) -> Iterator[str]:
    """The MJCF has the agreed names and limits."""
    model, dof = files.model, len(files.joints)
    wanted = {
        "bodies": (list(files.links), [model.body(i).name for i in range(1, model.nbody)]),
        "joints": ([f"joint{k + 1}" for k in range(dof)], [model.joint(i).name for i in range(model.njnt)]),
        "actuators": ([f"servo{k + 1}" for k in range(dof)], [model.actuator(i).name for i in range(model.nu)]),
    }
    for kind, (expected, found) in wanted.items():
        if expected != found:
            yield f"the {kind} of the MJCF are {', '.join(found)}; they must be {', '.join(expected)}"
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange") < 0:
        yield "the MJCF has no site 'flange'"
    if model.njnt == dof:
        if not np.allclose(model.jnt_range, files.limits, atol=1e-9):
            yield "the MJCF and robot.json have different joint limits"
        slides = model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)
        if list(slides) != list(files.arm.kinematics.slide):
            yield "the MJCF and robot.json have different joint types"
    if len(set(files.links)) < len(files.links):
        yield "two links have the same name"


def kinematics_faults(files: RobotFiles) -> Iterator[str]:
    """robot.json and the MJCF put every link at the same pose."""
    model, data = files.model, mujoco.MjData(files.model)
    q = np.random.default_rng(0).uniform(files.limits[:, 0], files.limits[:, 1], (_CONFIGURATIONS, len(files.joints)))
    poses = files.arm.kinematics.link_poses(q)
    flange = poses[-1] @ pose_of(files.robot["flange"])
    wrong = set()
    for row, configuration in enumerate(q):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        for k, link in enumerate(files.links):
            if not _same(data.body(link).xpos, data.body(link).xmat, poses[k, row]):
                wrong.add(link)
        if not _same(data.site("flange").xpos, data.site("flange").xmat, flange[row]):
            wrong.add("flange")
    for link in [*files.links, "flange"]:
        if link in wrong:
            yield f"robot.json and the MJCF put '{link}' at different poses"


def _same(position: np.ndarray, matrix: np.ndarray, pose: np.ndarray) -> bool:
    return bool(
        np.abs(position - pose[:3, 3]).max() < _POSE_TOLERANCE
        and np.abs(matrix.reshape(3, 3) - pose[:3, :3]).max() < _POSE_TOLERANCE
    )
