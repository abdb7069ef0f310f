"""Inverse kinematics of one arm: configurations that bring its tool point to a place, found with mink.

mink (https://github.com/kevinzakka/mink) moves a MuJoCo model in steps that a quadratic program chooses, within the
joint limits. Where it arrives depends on where it begins: at those of some thousand fixed configurations whose tools
are nearest to the target.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import Robot, Tool, frozen_array
from mmp_env.model.transforms import transform

NEAR_M, NEAR_RAD = 5e-4, 5e-3
"""A configuration is a solution when its tool point is this close to the target, and its tool points down like this."""
_STEPS, _LONGEST_STEP_RAD = 12, 0.5
_SLOWEST = 0.75
"""A step that leaves more of the way than this is the beginning of many: an unreachable target, as a rule."""
_BEGINNINGS, _NEAREST, _SEED = 8000, 60, 0
_HOPELESS = 0.8
"""Where even the nearest beginning is as far as this, an arm does not reach."""
_RAD_PER_M = 4.0
"""How a wrong direction counts beside a wrong place where beginnings are chosen."""
_DIGITS = 5
"""Solutions are rounded to so many: the last bits of a quadratic program are not the same on every machine."""
_NAME = "arm"


class Kinematics:
    """A robot with a tool, alone, its base at the origin."""

    def __init__(self, robot: Robot, tool: Tool | None) -> None:
        self._mink, self._robot = require(), robot
        upright = (robot.origins[0][:3, :3] @ robot.axes[0])[2]
        self._sense = float(np.sign(upright)) if abs(upright) > 1 - 1e-9 else 0.0
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
        share = np.random.default_rng(_SEED).random((_BEGINNINGS, robot.dof))
        # Beginnings stay off the limits, near which a step of a joint is cut short.
        room = 0.05 * (robot.draw_upper - robot.draw_lower)
        self._beginnings = robot.draw_lower + room + share * (robot.draw_upper - robot.draw_lower - 2 * room)
        points, directions = self._tools(model)
        # Where the first joint turns about the upright axis, a beginning faces anything: only its profile counts.
        self._azimuths = abs(self._sense) * np.arctan2(points[:, 1], points[:, 0])
        self._points, self._directions = (_about_z(rows, -self._azimuths) for rows in (points, directions))

    def tool_pose(self, q: Float[np.ndarray, " dof"]) -> Float[np.ndarray, "4 4"]:
        """Pose of the tool frame (the flange's without a tool) in the base frame."""
        return self._site_pose(q) @ transform(np.eye(3), -self._point)

    def beginnings(self, point: Float[np.ndarray, "3"], down: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n dof"]:
        """Where to begin for the tool point at `point` [m] and the tool pointing along `down`, in the base frame.

        At most `_NEAREST` of the fixed configurations, the nearest first, turned by their first joint to face the
        point; none where the arm does not reach.
        """
        azimuth = abs(self._sense) * np.arctan2(point[1], point[0])
        here, way = _about_z(np.array([point, down]), np.full(2, -azimuth))
        away = np.linalg.norm(self._points - here, axis=1) * _RAD_PER_M
        close = np.flatnonzero(away < _HOPELESS)
        away = away[close] + np.arccos(np.clip(self._directions[close] @ way, -1.0, 1.0))
        turn = (azimuth - self._azimuths[close] + np.pi) % (2 * np.pi) - np.pi
        first = self._beginnings[close, 0] + self._sense * turn
        usable = (away < _HOPELESS) & (first > self._robot.draw_lower[0]) & (first < self._robot.draw_upper[0])
        nearest = np.flatnonzero(usable)[np.argsort(away[usable], kind="stable")[:_NEAREST]]
        q = self._beginnings[close[nearest]]
        q[:, 0] = first[nearest]
        return q

    def solved(
        self, q: Float[np.ndarray, " dof"], point: Float[np.ndarray, "3"], down: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " dof"] | None:
        """The configuration [rad] with the tool at the target of `beginnings` where mink arrives from `q`, if any."""
        here, limits = self._configuration, self._limits
        here.update(q)
        # As the turn about the tool's axis is free, the present one will do for the target.
        x = self._site_pose(q)[:3, 0]
        x = x - (x @ down) * down
        x /= max(np.linalg.norm(x), 1e-9)
        target = transform(np.column_stack([x, np.cross(down, x), down]), point)
        self._task.set_target(self._mink.SE3.from_matrix(target))
        away = np.inf
        for _ in range(_STEPS):
            off = self._task.compute_error(here)
            wrong, turned = np.linalg.norm(off[:3]), np.linalg.norm(off[3:5])
            if wrong < NEAR_M and turned < NEAR_RAD:
                return np.round(here.q, _DIGITS)
            before, away = away, wrong * _RAD_PER_M + turned
            if away > _SLOWEST * before:
                return None
            step = self._mink.solve_ik(here, [self._task], 1.0, "daqp", damping=1e-6, limits=limits)
            longest = np.abs(step).max()
            here.integrate_inplace(step * min(1.0, _LONGEST_STEP_RAD / max(longest, 1e-12)), 1.0)
        return None

    def _tools(self, model: Any) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
        """Where the tool points are in all beginnings, and along what the tools point."""
        import mujoco

        data, site = mujoco.MjData(model), model.site(self._site).id
        points, directions = np.empty((2, _BEGINNINGS, 3))
        for k, q in enumerate(self._beginnings):
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


@functools.cache
def kinematics(robot: Robot, tool: Tool | None) -> Kinematics:
    """One of each robot and tool in a process. Raises `MmpError` where mink is not installed."""
    return Kinematics(robot, tool)


def require() -> Any:
    """The module `mink`. Raises `MmpError` with what to do where it is not installed."""
    try:
        import mink
    except ImportError as error:
        raise MmpError(
            f"this task finds configurations with mink, which cannot be imported ({error}); "
            "run: pip install 'mink>=1.0'"
        ) from None
    return mink
