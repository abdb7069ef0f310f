"""Inverse kinematics of one arm: configurations that bring its tool point to a place, found with mink.

mink (https://github.com/kevinzakka/mink) moves a MuJoCo model in steps that a quadratic program chooses, within the
joint limits. Where it arrives depends on where it begins: at those of some thousand fixed configurations whose tools
are nearest to the target.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.cell import Arm, Cell
from mmp_env.errors import MmpError
from mmp_env.robot import Robot, Tool, frozen_array
from mmp_env.transforms import transform

NEAR_M, NEAR_RAD = 5e-4, 5e-3
"""A configuration is a solution when its tool point is this close to the target, and its tool points down like this."""
_STEPS, _LONGEST_STEP_RAD = 12, 0.5
_BEGINNINGS, _NEAREST, _SEED = 8000, 12, 0
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
        from mmp_env.scene import compile_scene

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
        self._points, self._directions = self._tools(model)

    def tool_pose(self, q: Float[np.ndarray, " dof"]) -> Float[np.ndarray, "4 4"]:
        """Pose of the tool frame (the flange's without a tool) in the base frame."""
        return self._site_pose(q) @ transform(np.eye(3), -self._point)

    def solutions(
        self, point: Float[np.ndarray, "3"], down: Float[np.ndarray, "3"], rng: np.random.Generator
    ) -> Iterator[Float[np.ndarray, " dof"]]:
        """Configurations with the tool point at `point` [m] and the tool pointing along `down`, in the base frame.

        At most `_NEAREST` of them, in random order.
        """
        beginnings, points, directions = self._turned_to(point)
        away = np.linalg.norm(points - point, axis=1) * _RAD_PER_M
        away += np.arccos(np.clip(directions @ down, -1.0, 1.0))
        nearest = np.argsort(away, kind="stable")[:_NEAREST]
        nearest = nearest[away[nearest] < _HOPELESS]
        for k in rng.permutation(nearest):
            q = self._solved(beginnings[k], point, down)
            if q is not None:
                yield q

    def _solved(
        self, q: Float[np.ndarray, " dof"], point: Float[np.ndarray, "3"], down: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " dof"] | None:
        here, limits = self._configuration, self._limits
        here.update(q)
        # As the turn about the tool's axis is free, the present one will do for the target.
        x = self._site_pose(q)[:3, 0]
        x = x - (x @ down) * down
        x /= max(np.linalg.norm(x), 1e-9)
        target = transform(np.column_stack([x, np.cross(down, x), down]), point)
        self._task.set_target(self._mink.SE3.from_matrix(target))
        for _ in range(_STEPS):
            off = self._task.compute_error(here)
            if np.linalg.norm(off[:3]) < NEAR_M and np.linalg.norm(off[3:5]) < NEAR_RAD:
                return np.round(here.q, _DIGITS)
            step = self._mink.solve_ik(here, [self._task], 1.0, "daqp", damping=1e-6, limits=limits)
            longest = np.abs(step).max()
            here.integrate_inplace(step * min(1.0, _LONGEST_STEP_RAD / max(longest, 1e-12)), 1.0)
        return None

    def _turned_to(self, point: Float[np.ndarray, "3"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The beginnings, their tool points and directions, with the first joint turned so that they face a point."""
        azimuth = np.arctan2(self._points[:, 1], self._points[:, 0])
        turn = abs(self._sense) * ((np.arctan2(point[1], point[0]) - azimuth + np.pi) % (2 * np.pi) - np.pi)
        first = self._beginnings[:, 0] + self._sense * turn
        inside = (first > self._robot.draw_lower[0]) & (first < self._robot.draw_upper[0])
        q = self._beginnings[inside].copy()
        q[:, 0] = first[inside]
        turn = turn[inside]
        return q, _about_z(self._points[inside], turn), _about_z(self._directions[inside], turn)

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
