"""Motions as CSV and as NumPy archives."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.export.joint_names import file_part
from mmp_env.export.motion import Motion

_FORMULA = ("=", "+", "-", "@")
DERIVATIVES = {"velocities": "velocity", "accelerations": "acceleration"}


def csv_text(motion: Motion) -> str:
    """A row for each time: `time` [s], then a column for each joint [rad].

    A retimed motion has the velocities [rad/s] and accelerations [rad/s^2] behind, as `<joint>/velocity` and so on.
    Numbers are in the shortest form that reads back the same. A name that a spreadsheet would compute follows "'".
    """
    header, columns = ["time", *motion.joints], [motion.times[:, None], motion.joined("positions")]
    for key, word in DERIVATIVES.items():
        values = motion.joined(key)
        if values is not None:
            header += [f"{name}/{word}" for name in motion.joints]
            columns.append(values)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([_no_formula(name) for name in header])
    writer.writerows(np.concatenate(columns, axis=1).tolist())
    return text.getvalue()


def _no_formula(text: str) -> str:
    """Returns text that a spreadsheet shows and does not compute: after an apostrophe where it would be a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def write_npz(motion: Motion, path: Path) -> None:
    """Arrays `times` [t], `arms`, and of each arm `<arm>/joints`, `<arm>/positions` [t, dof], and so on.

    An arm whose name leads to another folder has another one there: each array is a file of an archive.
    """
    arrays: dict[str, Any] = {"times": motion.times, "arms": np.array(list(motion.arms))}
    for arm_name, arm in motion.arms.items():
        name = file_part(arm_name)
        arrays[f"{name}/joints"] = np.array(arm.joints)
        for key in ("positions", *DERIVATIVES):
            values = getattr(arm, key)
            if values is not None:
                arrays[f"{name}/{key}"] = values
    with path.open("wb") as file:  # given a name, savez would add its own suffix
        np.savez(file, **arrays)
