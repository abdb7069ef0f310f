"""Inverse kinematics of one arm with mink: configurations that bring its tool point to a target.

mink (https://github.com/kevinzakka/mink) moves a MuJoCo model in steps that a quadratic program chooses, within the
joint limits. The solution depends on the initial guess. Initial guesses are those of 8000 fixed random configurations
whose tools are nearest to the target.
"""

from __future__ import annotations

import functools
import threading
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import Robot, Tool, frozen_array
from mmp_env.model.transforms import transform

POSITION_TOLERANCE_M, DIRECTION_TOLERANCE_RAD = 5e-4, 5e-3
"""Largest errors of the tool point and of the direction of the tool in a solution."""
_MAX_STEPS, _MAX_STEP = 12, 0.5
"""Largest number of steps, and largest motion of a joint in one step [rad or m]."""
_MAX_REMAINING = 0.75
"""Largest share of the error that may remain after a step. Slower steps usually mean an unreachable target."""
_GUESSES, _NEAREST, _SEED = 8000, 60, 0
"""Number of fixed random configurations, number of initial guesses for a target, and seed of the configurations."""
_MAX_ERROR_RAD = 0.8
"""Largest error of an initial guess. The arm does not reach a target if all guesses are farther away."""
_RAD_PER_M = 4.0
"""Weight of a position error relative to a direction error."""
_DIGITS = 5
"""Decimal places of solutions. The last bits of a quadratic program are not the same on every machine."""
_NAME = "arm"


class Kinematics:
    """The inverse kinematics of a robot with a tool, its base at the origin. Several threads may use one."""

    def __init__(self, robot: Robot, tool: Tool | None) -> None:
        self._lock = threading.RLock()  # `solve` and `tool_pose` move one configuration of MuJoCo
        self._mink, self._robot = require(), robot
        axis = robot.origins[0][:3, :3] @ robot.axes[0] / np.linalg.norm(robot.axes[0])
        turns = abs(axis[2]) > 1 - 1e-9 and not robot.slides[0]
        self._turn_sign = float(np.sign(axis[2])) if turns else 0.0
        self._slide = axis if robot.slides[0] else np.zeros(3)
        from mmp_env.sim.scene import compile_scene

        unturned = frozen_array([1.0, 0.0, 0.0, 0.0])
        arm = Arm(name=_NAME, robot=robot, tool=tool, position=frozen_array(np.zeros(3)), quaternion=unturned)
        model = compile_scene(Cell(name=robot.name, arms=(arm,)))
        self._site = f"{_NAME}/{'tool_point' if tool else 'flange'}"
        self._point = tool.point if tool else np.zeros(3)
        self._configuration: Any = self._mink.Configuration(model)
        # The third axis of the tool is its own: a grasp from above may turn about it.
        self._task: Any = self._mink.FrameTask(self._site, "site", 1.0, [0.3, 0.3, 0.0], lm_damping=1e-4)
        self._limits = [self._mink.ConfigurationLimit(model)]
        share = np.random.default_rng(_SEED).random((_GUESSES, robot.dof))
        # Guesses keep away from the joint limits, which would cut short the steps of a joint.
        inset = 0.05 * (robot.draw_upper - robot.draw_lower)
        self._guesses = robot.draw_lower + inset + share * (robot.draw_upper - robot.draw_lower - 2 * inset)
        points, directions = self._tools(model)
        # If the first joint turns about the upright axis, a guess can face any direction: only its profile counts. If
        # it slides, a guess can be anywhere along the axis: only its place off the axis counts.
        self._azimuths = abs(self._turn_sign) * np.arctan2(points[:, 1], points[:, 0])
        self._points, self._directions = (_about_z(rows, -self._azimuths) for rows in (points, directions))
        self._along = points @ self._slide
        self._points = self._points - np.outer(self._along, self._slide)

    def tool_pose(self, q: Float[np.ndarray, " dof"]) -> Float[np.ndarray, "4 4"]:
        """Returns the pose of the tool frame (the flange without a tool) in the base frame."""
        with self._lock:
            return self._site_pose(q) @ transform(np.eye(3), -self._point)

    def initial_guesses(
        self, point: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "n dof"]:
        """Returns initial guesses [rad or m] for a target, the nearest first; none if the arm does not reach it.

        These are up to `_NEAREST` of the fixed configurations, moved by their first joint towards the target: turned to
        face it, or slid to it.

        Args:
            point: target of the tool point in the base frame [m].
            direction: unit vector in the base frame along which the tool points.
        """
        azimuth = abs(self._turn_sign) * np.arctan2(point[1], point[0])
        here, toward = _about_z(np.array([point, direction]), np.full(2, -azimuth))
        here = here - (here @ self._slide) * self._slide
        error = np.linalg.norm(self._points - here, axis=1) * _RAD_PER_M
        close = np.flatnonzero(error < _MAX_ERROR_RAD)
        error = error[close] + np.arccos(np.clip(self._directions[close] @ toward, -1.0, 1.0))
        turn = (azimuth - self._azimuths[close] + np.pi) % (2 * np.pi) - np.pi
        first = self._guesses[close, 0] + self._turn_sign * turn + (point @ self._slide - self._along[close])
        usable = (error < _MAX_ERROR_RAD) & (first > self._robot.draw_lower[0]) & (first < self._robot.draw_upper[0])
        nearest = np.flatnonzero(usable)[np.argsort(error[usable], kind="stable")[:_NEAREST]]
        q = self._guesses[close[nearest]]
        q[:, 0] = first[nearest]
        return q

    def solve(
        self, q: Float[np.ndarray, " dof"], point: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " dof"] | None:
        """Returns the solution [rad or m] that mink finds from the initial guess `q`, or None. Targets as above."""
        with self._lock:
            return self._solve(q, point, direction)

    def _solve(
        self, q: Float[np.ndarray, " dof"], point: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " dof"] | None:
        here, limits = self._configuration, self._limits
        here.update(q)
        # The turn about the axis of the tool is free, so the target takes that of the guess.
        x = self._site_pose(q)[:3, 0]
        x = x - (x @ direction) * direction
        x /= max(np.linalg.norm(x), 1e-9)
        target = transform(np.column_stack([x, np.cross(direction, x), direction]), point)
        self._task.set_target(self._mink.SE3.from_matrix(target))
        error = np.inf
        for _ in range(_MAX_STEPS):
            twist = self._task.compute_error(here)
            distance, angle = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:5])
            if distance < POSITION_TOLERANCE_M and angle < DIRECTION_TOLERANCE_RAD:
                return np.round(here.q, _DIGITS)
            before, error = error, distance * _RAD_PER_M + angle
            if error > _MAX_REMAINING * before:
                return None
            step = self._mink.solve_ik(here, [self._task], 1.0, "daqp", damping=1e-6, limits=limits)
            longest = np.abs(step).max()
            here.integrate_inplace(step * min(1.0, _MAX_STEP / max(longest, 1e-12)), 1.0)
        return None

    def _tools(self, model: Any) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
        """Returns the tool point [m] and the direction of the tool in every fixed configuration."""
        import mujoco

        data, site = mujoco.MjData(model), model.site(self._site).id
        points, directions = np.empty((2, _GUESSES, 3))
        for k, q in enumerate(self._guesses):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            points[k], directions[k] = data.site_xpos[site], data.site_xmat[site].reshape(3, 3)[:, 2]
        return points, directions

    def _site_pose(self, q: Float[np.ndarray, " dof"]) -> Float[np.ndarray, "4 4"]:
        self._configuration.update(q)
        return self._configuration.get_transform_frame_to_world(self._site, "site").as_matrix()


def _about_z(rows: Float[np.ndarray, "n 3"], turn: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    c, s = np.cos(turn), np.sin(turn)
    return np.column_stack([c * rows[:, 0] - s * rows[:, 1], s * rows[:, 0] + c * rows[:, 1], rows[:, 2]])


@functools.lru_cache(maxsize=64)
def kinematics(robot: Robot, tool: Tool | None) -> Kinematics:
    """Returns the inverse kinematics of a robot with a tool. Raises `MmpError` if mink is not installed."""
    return Kinematics(robot, tool)


def require() -> Any:
    """Returns the module `mink`. Raises `MmpError` with the command that installs it."""
    try:
        import mink
    except ImportError as error:
        raise MmpError(
            f"this task finds configurations with mink, which cannot be imported ({error}); "
            "run: pip install 'mink>=1.0'"
        ) from None
    return mink
