"""The formats by suffix, and writing them so that there are whole files or none."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from os import PathLike
from pathlib import Path

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.export.joint_names import FIELD, JOINT_NAMES, check_distinct, file_part
from mmp_env.export.motion import Motion, motion_of
from mmp_env.export.ros import yaml_text
from mmp_env.export.tables import csv_text, write_npz
from mmp_env.files.writing import whole_file
from mmp_env.model.plan import Plan

ARM = "arm"
FORMATS = {
    ".csv": "a table: time, then a column for each joint",
    ".npz": "NumPy arrays of each arm",
    ".yaml": "ROS 2 trajectory_msgs/msg/JointTrajectory",
    ".xml": "the cell as MJCF with keyframes start and goal",
}
"""Suffix -> what it is."""


def export_plan(
    plan: Plan | Sequence[Plan], path: str | PathLike[str], *, joint_names: str = JOINT_NAMES
) -> dict[Path, Motion]:
    """Writes a plan, or plans one after another as one motion, in the format of the suffix; all files or none.

    With `{arm}` in its name there is a file for each arm. Returns what was written, file -> motion. Raises `MmpError`
    for an unknown suffix or placeholder, for joints that get the same name, and where the system refuses to write.
    """
    check_target(path)
    plans = [plan] if isinstance(plan, Plan) else list(plan)
    motion = motion_of(plans, joint_names)
    parts = _parts(motion, str(path))
    for content in parts.values():
        check_distinct(content.joints, joint_names)
    with ExitStack() as stack:
        for part, content in parts.items():
            _write(_suffix(path), plans, content, stack.enter_context(whole_file(part)))
    return parts


def check_target(path: str | PathLike[str]) -> None:
    """Raises `MmpError` where no format goes with the name; whether it can be written is looked at when it is."""
    suffix = _suffix(path)
    if not suffix:
        raise MmpError(
            f"'{path}' does not say in which format; the name must end in {', '.join(FORMATS)}, as plan.csv does"
        )
    if suffix not in FORMATS:
        raise UnknownNameError("export format", suffix, FORMATS)
    fields = FIELD.findall(str(path))
    for field in fields:
        if field != ARM:
            raise UnknownNameError("placeholder of file names", field, [ARM])
    if fields and suffix == ".xml":
        raise MmpError(f"'{path}' asks for a file for each arm, but the MJCF is of the whole cell; leave {{arm}} out")


def _suffix(path: str | PathLike[str]) -> str:
    return Path(path).suffix.lower()


def of_arm(path: str, arm: str) -> str:
    """Returns the name of the file for an arm, which leads to no other folder, whatever the arm is called."""
    return path.replace(f"{{{ARM}}}", file_part(arm))


def _parts(motion: Motion, path: str) -> dict[Path, Motion]:
    """The files to write, and the motion for each."""
    if f"{{{ARM}}}" not in path:
        return {Path(path): motion}
    return {Path(of_arm(path, name)): motion.only(name) for name in motion.arms}


def _write(suffix: str, plans: Sequence[Plan], motion: Motion, path: Path) -> None:
    if suffix == ".npz":
        write_npz(motion, path)
        return
    if suffix == ".xml":
        # MuJoCo is imported for those alone who ask for its format.
        from mmp_env.export.mjcf import mjcf_text

        text = mjcf_text(plans[0].problem.cell, {"start": plans[0].problem.start, "goal": plans[-1].problem.goal})
    else:
        text = {".csv": csv_text, ".yaml": yaml_text}[suffix](motion)
    path.write_text(text, encoding="utf-8")
