"""Kinematics of a serial chain from its base frame to its tool frame, for many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float


@runtime_checkable
class ArmModel(Protocol):
    """The numbers of a robot that inverse kinematics needs; `mmp_env.Robot` has them and says what they mean."""

    @property
    def origins(self) -> Float[np.ndarray, "dof 4 4"]: ...
    @property
    def axes(self) -> Float[np.ndarray, "dof 3"]: ...
    @property
    def slides(self) -> tuple[bool, ...]: ...
    @property
    def lower(self) -> Float[np.ndarray, "dof"]: ...
    @property
    def upper(self) -> Float[np.ndarray, "dof"]: ...
    @property
    def home(self) -> Float[np.ndarray, "dof"]: ...
    @property
    def flange(self) -> Float[np.ndarray, "4 4"]: ...


@runtime_checkable
class ToolModel(Protocol):
    """The number of a tool that inverse kinematics needs: T_flange_tool."""

    @property
    def mount(self) -> Float[np.ndarray, "4 4"]: ...


class Frames(NamedTuple):
    """Joint axes and tool frames of configurations in the base frame: unit vectors, points on the axes [m], poses."""

    axes: Float[np.ndarray, "n dof 3"]
    points: Float[np.ndarray, "n dof 3"]
    rotation: Float[np.ndarray, "n 3 3"]
    position: Float[np.ndarray, "n 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class SerialChain:
    """A chain of hinges and slides, described at zero positions in frames that are parallel to the base frame.

    Attributes:
        axes: unit vector of each joint.
        offsets: from the base to joint 0, from each joint to the next one, and from the last joint to the tool [m].
        slides: whether each joint slides along its axis.
        tool: rotation matrix of the tool frame.
    """

    axes: Float[np.ndarray, "dof 3"]
    offsets: Float[np.ndarray, "dof+1 3"]
    slides: Bool[np.ndarray, "dof"]
    tool: Float[np.ndarray, "3 3"]

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.axes)

    @cached_property
    def numbers(self) -> dict[str, np.ndarray]:
        """The chain as arguments of the core."""
        values = {"axes": self.axes, "offsets": self.offsets, "slides": self.slides, "tool": self.tool}
        return {name: np.ascontiguousarray(value) for name, value in values.items()}

    @cached_property
    def length(self) -> float:
        """Sum of the offsets after the first joint [m], at least 0.1: the scale of position errors."""
        return max(float(np.linalg.norm(self.offsets[1:], axis=1).sum()), 0.1)

    def frames(self, q: Float[np.ndarray, "n dof"]) -> Frames:
        """Returns axes and tool frames of configurations."""
        count = len(q)
        rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.tile(self.offsets[0], (count, 1))
        axes, points = np.empty((2, count, self.dof, 3))
        for k, axis in enumerate(self.axes):
            axes[:, k], points[:, k] = rotation @ axis, position
            if self.slides[k]:
                position = position + q[:, k, None] * axes[:, k]
            else:
                rotation = _turned(rotation, axis, q[:, k])
            position = position + rotation @ self.offsets[k + 1]
        return Frames(axes, points, rotation @ self.tool, position)


def chain_of(robot: ArmModel, tool: ToolModel | None) -> SerialChain:
    """Returns the chain from the base of a robot to the frame of its tool, or to its flange without one."""
    pose, points, axes = np.eye(4), [np.zeros(3)], []
    for origin, axis in zip(robot.origins, robot.axes, strict=True):
        pose = pose @ origin
        axes.append(pose[:3, :3] @ axis / np.linalg.norm(axis))
        points.append(pose[:3, 3])
    end = pose @ robot.flange @ (np.eye(4) if tool is None else tool.mount)
    return SerialChain(
        axes=np.array(axes),
        offsets=np.diff([*points, end[:3, 3]], axis=0),
        slides=np.array(robot.slides),
        tool=end[:3, :3],
    )


def _turned(
    rotation: Float[np.ndarray, "n 3 3"], axis: Float[np.ndarray, "3"], angle: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n 3 3"]:
    """Returns rotation matrices times those about a unit vector; faster than products of small matrices."""
    skew = _skew(axis)
    rows = rotation.reshape(-1, 3)
    sine, versine = np.sin(angle)[:, None, None], 1 - np.cos(angle)[:, None, None]
    return rotation + sine * (rows @ skew).reshape(-1, 3, 3) + versine * (rows @ (skew @ skew)).reshape(-1, 3, 3)


def rotation_about(axis: Float[np.ndarray, "3"], angles: Float[np.ndarray, "..."]) -> Float[np.ndarray, "... 3 3"]:
    """Returns the rotation matrices about a unit vector by angles [rad]."""
    skew = _skew(axis)
    sine, cosine = np.sin(angles)[..., None, None], np.cos(angles)[..., None, None]
    return np.eye(3) + sine * skew + (1 - cosine) * (skew @ skew)


def _skew(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Returns the matrix of the cross product with a vector."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
