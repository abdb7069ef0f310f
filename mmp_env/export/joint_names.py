"""Names of joints in exported files, by a pattern such as `{arm}/{joint}` or `{arm}_{vendor}`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.writing import file_name
from mmp_env.model.cell import Cell

JOINT_NAMES = "{arm}/{joint}"
"""Default pattern, which gives the names of the MuJoCo model: `arm0/joint1`."""
PLACEHOLDERS = {
    "arm": "name of the arm",
    "joint": "joint1, joint2, ... from the base outwards",
    "number": "1, 2, ...",
    "vendor": "the joint in the vendor's description, such as shoulder_pan_joint",
    "robot": "name of the robot",
}
"""Placeholder of a pattern -> its meaning."""
FIELD = re.compile(r"\{([^{}]*)\}")
"""Regular expression of a placeholder in a pattern of joint names or a file name."""
_OTHER_FOLDER = re.compile(r"^\.+$|[/\\]")


def joint_names(cell: Cell, pattern: str = JOINT_NAMES) -> dict[str, tuple[str, ...]]:
    """Returns arm name -> the names of its joints.

    Raises `MmpError` for an unknown placeholder and for characters that do not print.
    """
    for field in FIELD.findall(pattern):
        if field not in PLACEHOLDERS:
            raise UnknownNameError("placeholder of joint names", field, PLACEHOLDERS)
    out = {}
    for arm in cell.arms:
        names = []
        for number, vendor in enumerate(arm.robot.joint_names, start=1):
            words = (arm.name, f"joint{number}", str(number), vendor, arm.robot.name)
            word = dict(zip(PLACEHOLDERS, words, strict=True))
            names.append(FIELD.sub(lambda match, word=word: word[match[1]], pattern))
        out[arm.name] = tuple(names)
        for name in names:
            if not name.isprintable():
                raise MmpError(f"joint name {name!r} has characters that do not print; controllers would refuse it")
    return out


def file_part(arm: str) -> str:
    """Returns the arm's name as part of a file name, replaced if it leads to another folder."""
    return file_name(arm) if _OTHER_FOLDER.search(arm) else arm


def check_distinct(names: Sequence[str], pattern: str) -> None:
    """Raises `MmpError` if two joints of one file have the same name."""
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        raise MmpError(f"joint names '{pattern}' call {count} joints '{name}'; {{arm}} and {{joint}} tell them apart")
