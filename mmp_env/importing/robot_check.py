"""The contract test of a robot folder: every fault in one sentence, and what was proved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from mmp_env.errors import MmpError, in_words
from mmp_env.importing.checked_files import RobotReport, read_robot_files
from mmp_env.importing.file_faults import fingerprint_faults, limit_faults
from mmp_env.importing.geometry_faults import cover_faults, hull_faults
from mmp_env.importing.mjcf_faults import kinematics_faults, name_faults
from mmp_env.importing.pair_faults import pair_faults, pose_faults
from mmp_env.mujoco_import import without_log

Progress = Callable[[str], None]


def check_robot(folder: Path, progress: Progress = lambda line: None) -> RobotReport:
    """Returns the report on a robot folder. Faults of any kind are in the report; nothing is raised for them."""
    report = RobotReport()
    files = read_robot_files(folder, report.faults)
    if files is None:
        return report
    steps: list[tuple[str, Iterator[str]]] = [
        ("fingerprints", fingerprint_faults(files)),
        ("limits", limit_faults(files)),
        ("names", name_faults(files)),
        ("kinematics", kinematics_faults(files)),
        ("hulls", hull_faults(files)),
        ("covers", cover_faults(files, report)),
        ("self-collision pairs", pair_faults(files)),
        ("poses", pose_faults(files)),
    ]
    for name, faults in steps:
        progress(name)
        before = len(report.faults)
        try:
            with without_log():
                for fault in faults:
                    report.faults.append(fault)
        except (MmpError, ArithmeticError, AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
            report.faults.append(f"{name} cannot be checked: {in_words(error)}")
        if len(report.faults) == before:
            report.proved.append(name)
    return report
