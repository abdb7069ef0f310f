"""Export formats by suffix. An export writes all files or none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from os import PathLike
from pathlib import Path

from mmp_env import argument_checks
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.export.joint_names import FIELD, JOINT_NAMES, check_distinct, file_part
from mmp_env.export.motion import Motion, motion_of
from mmp_env.export.ros import yaml_text
from mmp_env.export.tables import csv_text, write_npz
from mmp_env.files.writing import check_file_name, whole_file
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan

ARM = "arm"
"""Placeholder of file names: a file for each arm."""
FORMATS = {
    ".csv": "a table: time, then a column for each joint",
    ".npz": "NumPy arrays of each arm",
    ".yaml": "ROS 2 trajectory_msgs/msg/JointTrajectory",
    ".xml": "the cell as MJCF with keyframes start and goal",
}
"""Suffix -> description of the format."""


def export_plan(
    plan: Plan | Sequence[Plan], path: str | PathLike[str], *, joint_names: str = JOINT_NAMES
) -> dict[Path, Motion]:
    """Writes a plan in the format of the suffix, all files or none. docs/how-to/export.md describes the formats.

    Args:
        plan: a plan, or plans in a row, which become one motion.
        path: the file: `.csv`, `.npz`, `.yaml` (ROS 2) or `.xml` (MJCF). `{arm}` in its name makes a file for each arm.
        joint_names: pattern of the joints' names, such as `{arm}/{joint}` or `{arm}_{vendor}`.

    Returns:
        File -> the motion that it holds.

    Raises:
        MmpError: for no plan, an unknown suffix or placeholder, joints of the same name, plans that do not follow one
            another, and files that cannot be written.
    """
    check_target(argument_checks.path("path", path))
    pattern = argument_checks.text("joint_names", joint_names)
    plans = [given_plan(each, "export") for each in _in_a_row(plan)]
    motion = motion_of(plans, pattern)
    parts = _parts(motion, str(path))
    for content in parts.values():
        check_distinct(content.joints, pattern)
    with ExitStack() as stack:
        for part, content in parts.items():
            _write(_suffix(path), plans, content, stack.enter_context(whole_file(part)))
    return parts


def _in_a_row(plan: object) -> list[object]:
    """Returns the plans, not checked: the elements of a sequence, or the object alone."""
    return list(plan) if isinstance(plan, Iterable) and not isinstance(plan, str | Mapping) else [plan]


def check_target(path: str | PathLike[str]) -> None:
    """Raises `MmpError` for a name without an export format, and for one that ends like the path of a folder.

    It does not test whether the file can be written.
    """
    check_file_name(path)
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
    """Returns the name of the file for an arm. No name of an arm leads to another folder."""
    return path.replace(f"{{{ARM}}}", file_part(arm))


def _parts(motion: Motion, path: str) -> dict[Path, Motion]:
    """Returns file -> the motion that it is to hold."""
    if f"{{{ARM}}}" not in path:
        return {Path(path): motion}
    return {Path(of_arm(path, name)): motion.only(name) for name in motion.arms}


def _write(suffix: str, plans: Sequence[Plan], motion: Motion, path: Path) -> None:
    if suffix == ".npz":
        write_npz(motion, path)
        return
    if suffix == ".xml":
        # Imported here, because only this format needs MuJoCo.
        from mmp_env.export.mjcf import mjcf_text

        text = mjcf_text(plans[0].problem.cell, {"start": plans[0].problem.start, "goal": plans[-1].problem.goal})
    else:
        text = {".csv": csv_text, ".yaml": yaml_text}[suffix](motion)
    path.write_text(text, encoding="utf-8")
