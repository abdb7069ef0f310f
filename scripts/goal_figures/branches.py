"""Completeness, accuracy and time of the configurations for tool poses."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import mujoco
import numpy as np
from figure import print_figure
from jaxtyping import Float

from mmp_env import Arm, Cell, place_arm
from mmp_env.ik import branches
from mmp_env.ik.chain import chain_of
from mmp_env.ik.refinement import refined
from mmp_env.ik.tool_task import ToolTask
from mmp_env.ik.turns import JointBox, distinct
from mmp_env.model.transforms import transform
from mmp_env.sim.scene import compile_scene

RESTARTS, STEPS = 512, 40
"""Random restarts for a pose, and most steps of each."""
SAME_RAD = 1e-3
"""Largest difference of a joint [rad or m] between a branch of the restarts and that of `branches`."""
SELF_MOTION_RAD = 0.1
"""Largest difference of a joint [rad or m] between a sample of a self-motion and a configuration of `branches`."""
LIMIT = 100_000
NAME = "arm"


class Found(NamedTuple):
    """The measurements at one pose: distances of restarts' solutions [rad], errors [m, rad], candidates, time [s]."""

    distances: Float[np.ndarray, "n"]
    position: float
    rotation: float
    candidates: int
    cpu_s: float


def measure(name: str, poses: int) -> None:
    """Prints the figures of a robot with its own tool.

    Args:
        name: name of the robot.
        poses: number of poses, those of the tool at random configurations within the limits of draws.
    """
    arm = place_arm(NAME, name, [0, 0, 0], [1, 0, 0, 0])
    kinematics, rng = MujocoKinematics(arm), np.random.default_rng(0)
    box = JointBox(lower=arm.robot.lower, upper=arm.robot.upper, hinges=~np.array(arm.robot.slides))
    found = []
    for _ in range(poses):
        q = rng.uniform(arm.robot.draw_lower, arm.robot.draw_upper)
        found.append(_at_pose(arm, box, kinematics, q, rng))
    near = SAME_RAD if arm.robot.dof <= 6 else SELF_MOTION_RAD
    distances = np.concatenate([pose.distances for pose in found])
    times, counts = [pose.cpu_s for pose in found], [pose.candidates for pose in found]
    hits, mean = int((distances <= near).sum()), float(np.mean(counts))
    more = {"poses": poses, "restarts": RESTARTS, "within": near, "farthest": float(distances.max(initial=0.0))}
    print_figure(f"ik/{name}/found", hits, f"of {len(distances)}", **more)
    print_figure(f"ik/{name}/candidates", mean, "configurations", fewest=min(counts), most=max(counts))
    print_figure(f"ik/{name}/position_error", max(pose.position for pose in found), "m", poses=poses)
    print_figure(f"ik/{name}/rotation_error", max(pose.rotation for pose in found), "rad", poses=poses)
    tail = {"p90": float(np.quantile(times, 0.9)), "most": max(times), "poses": poses}
    print_figure(f"ik/{name}/time", float(np.median(times)), "s", **tail)


def _at_pose(
    arm: Arm, box: JointBox, kinematics: MujocoKinematics, q: Float[np.ndarray, "dof"], rng: np.random.Generator
) -> Found:
    pose = kinematics.tool_pose(q)
    begin = time.process_time()
    candidates = branches(arm.robot, arm.tool, pose, limit=LIMIT)
    cpu_s = time.process_time() - begin
    errors = np.array([_errors(kinematics.tool_pose(each), pose) for each in candidates]).reshape(-1, 2)
    solutions = _by_restarts(arm, box, pose, rng)
    distances = np.full(len(solutions), np.inf)
    if len(candidates):
        distances = np.array([np.abs(candidates - each).max(axis=1).min() for each in solutions])
    position, rotation = errors.max(axis=0, initial=0.0)
    return Found(distances, float(position), float(rotation), len(candidates), cpu_s)


def _by_restarts(
    arm: Arm, box: JointBox, pose: Float[np.ndarray, "4 4"], rng: np.random.Generator
) -> Float[np.ndarray, "n dof"]:
    """Returns the configurations within the limits that a numeric solver finds from random configurations."""
    lower, upper = box.one_turn()
    task = ToolTask(chain=chain_of(arm.robot, arm.tool), free=None)
    starts = rng.uniform(lower, upper, (RESTARTS, arm.robot.dof))
    q, _ = refined(task, starts, np.broadcast_to(pose, (RESTARTS, 4, 4)), steps=STEPS)
    return distinct(box.within(q), SAME_RAD)


def _errors(pose: Float[np.ndarray, "4 4"], target: Float[np.ndarray, "4 4"]) -> tuple[float, float]:
    """Returns the distance [m] and the angle [rad] between two poses."""
    sine = np.linalg.norm(pose[:3, :3] - target[:3, :3]) / np.sqrt(8)
    return float(np.linalg.norm(pose[:3, 3] - target[:3, 3])), float(2 * np.arcsin(min(sine, 1.0)))


class MujocoKinematics:
    """MuJoCo's own forward kinematics of an arm at the origin."""

    def __init__(self, arm: Arm) -> None:
        self._model = compile_scene(Cell(name=NAME, arms=(arm,)))
        self._data: Any = mujoco.MjData(self._model)
        self._site = self._model.site(f"{NAME}/{'tool_point' if arm.tool else 'flange'}").id
        point = np.zeros(3) if arm.tool is None else arm.tool.point
        self._site_to_tool = transform(np.eye(3), -point)

    def tool_pose(self, q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "4 4"]:
        """Returns the pose of the tool frame, or of the flange without a tool, in the base frame."""
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._model, self._data)
        site = self._data.site_xmat[self._site].reshape(3, 3), self._data.site_xpos[self._site]
        return transform(*site) @ self._site_to_tool
