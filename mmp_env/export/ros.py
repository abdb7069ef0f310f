"""Writes and reads ROS 2 `trajectory_msgs/msg/JointTrajectory` as YAML, without ROS."""

from __future__ import annotations

import json
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.export.motion import Motion
from mmp_env.files.reading import MAX_JSON_BYTES, named, unique
from mmp_env.files.regular_files import read_bytes
from mmp_env.files.yaml_reading import yaml_value
from mmp_env.wording import counted, in_seconds, shown

_NANO = 10**9
_LARGEST_SEC = 2**31 - 1
_FIELDS = ("positions", "velocities", "accelerations")
_UNTIMED = "# Positions only: the plan is not retimed. Controllers move in straight lines between the points.\n"


@dataclass(frozen=True, kw_only=True, eq=False)
class JointTrajectory:
    """The message.

    Attributes:
        joint_names: names of the joints [n].
        times: times from the start [t] [s].
        positions: [t, n] [rad, of slides m].
        velocities: [t, n] [rad/s], or None if the message has none.
        accelerations: [t, n] [rad/s^2], or None if the message has none.
    """

    joint_names: tuple[str, ...]
    times: Float[np.ndarray, "t"]
    positions: Float[np.ndarray, "t n"]
    velocities: Float[np.ndarray, "t n"] | None
    accelerations: Float[np.ndarray, "t n"] | None

    @brief
    def __repr__(self) -> str:
        joints, samples = counted(len(self.joint_names), "joint"), counted(len(self.times), "sample")
        return f"of {joints}: {samples}, {in_seconds(float(self.times[-1]))}"


def yaml_text(motion: Motion) -> str:
    """Returns one message that starts on arrival (stamp 0), with the derivatives of a retimed motion.

    Raises `MmpError` for two times in the same nanosecond, which controllers refuse, and for times too late for the
    message.
    """
    values = {key: motion.joined(key) for key in _FIELDS}
    comment = _UNTIMED if values["velocities"] is None else ""
    lines = [
        f"# trajectory_msgs/msg/JointTrajectory\n{comment}header:\n  stamp: {{sec: 0, nanosec: 0}}\n  frame_id: ''",
        f"joint_names: {json.dumps(motion.joints, ensure_ascii=False)}",
        "points:",
    ]
    rows = {key: [_numbers(row) for row in value.tolist()] for key, value in values.items() if value is not None}
    for k, nanoseconds in enumerate(_nanoseconds(motion.times).tolist()):
        sec, nanosec = divmod(nanoseconds, _NANO)
        fields = [f"{key}: {rows[key][k]}" for key in rows]
        lines.append("- " + "\n  ".join([*fields, f"time_from_start: {{sec: {sec}, nanosec: {nanosec}}}"]))
    return "\n".join(lines) + "\n"


def load_joint_trajectory(path: str | PathLike[str]) -> JointTrajectory:
    """Reads a message that `export_plan` or `ros2 topic echo` wrote.

    Args:
        path: a YAML file of at most 64 MB.

    Raises:
        MmpError: for a file that cannot be read, or a fault in it, with file and field.
    """
    content = read_bytes(path, MAX_JSON_BYTES, "trajectory")
    with named(str(path)):
        data = yaml_value(content, unique)
    try:
        points = data["points"]
        times = [_time(point["time_from_start"]) for point in points]
        names = tuple(data["joint_names"])
        fields = {key: _matrix(points, key, len(names)) for key in _FIELDS}
    except (KeyError, TypeError, ValueError) as error:
        raise MmpError(f"{path} is no JointTrajectory: {type(error).__name__}: {error}") from None
    positions = fields.pop("positions")
    if positions is None:
        raise MmpError(f"{path} has no positions")
    return JointTrajectory(joint_names=names, times=np.array(times) / _NANO, positions=positions, **fields)


def _time(stamp: Any) -> int:
    """Returns a duration in nanoseconds. Raises `TypeError` for a bad one."""
    sec, nanosec = stamp["sec"], stamp["nanosec"]
    if type(sec) is not int or type(nanosec) is not int:
        raise TypeError(f"time_from_start is {shown(stamp)}; it must have whole numbers sec and nanosec")
    return sec * _NANO + nanosec


def _matrix(points: list[dict[str, Any]], key: str, count: int) -> Float[np.ndarray, "t n"] | None:
    """Returns a field of all points, None if it is empty in all of them. Raises `ValueError` for a wrong length."""
    rows = [point.get(key) or [] for point in points]
    if not any(rows):
        return None
    for k, row in enumerate(rows):
        if len(row) != count:
            raise ValueError(f"points[{k}].{key} has {len(row)} numbers for {count} joints")
    return np.array(rows, dtype=float)


def _nanoseconds(times: Float[np.ndarray, "t"]) -> Int[np.ndarray, "t"]:
    beyond = np.flatnonzero(~(np.abs(times) < _LARGEST_SEC))
    if len(beyond):
        raise MmpError(f"time {times[beyond[0]]:g} s does not fit time_from_start, which ends at {_LARGEST_SEC} s")
    out = np.rint(times * _NANO).astype(np.int64)
    late = np.flatnonzero(np.diff(out) <= 0)
    if len(late):
        k = int(late[0])
        raise MmpError(
            f"time {times[k + 1]} s of sample {k + 1} comes less than 1 ns after {times[k]} s; "
            "a JointTrajectory has times that ascend"
        )
    return out


def _numbers(row: list[float]) -> str:
    return f"[{', '.join(map(_number, row))}]"


def _number(value: float) -> str:
    """Returns the shortest form with a point. For YAML 1.1, which ROS reads, 1e-05 is text."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")
