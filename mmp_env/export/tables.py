"""Writes motions as CSV and as NumPy archives."""

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
    """Returns a row for each time: `time` [s], then a column for each joint [rad, of a slide m].

    A retimed motion has velocities [rad/s] and accelerations [rad/s^2] in further columns, `<joint>/velocity` and so
    on. Numbers have the shortest form that reads back the same. An apostrophe precedes a name that is a formula.
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
    """Returns text that a spreadsheet does not compute: an apostrophe precedes a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def write_npz(motion: Motion, path: Path) -> None:
    """Writes arrays `times` [t], `arms`, and for each arm `<arm>/joints`, `<arm>/positions` [t, dof], and so on.

    Each array is a file of an archive, so an arm's name is replaced if it leads to another folder.
    """
    arrays: dict[str, Any] = {"times": motion.times, "arms": np.array(list(motion.arms))}
    for arm_name, arm in motion.arms.items():
        name = file_part(arm_name)
        arrays[f"{name}/joints"] = np.array(arm.joints)
        for key in ("positions", *DERIVATIVES):
            values = getattr(arm, key)
            if values is not None:
                arrays[f"{name}/{key}"] = values
    with path.open("wb") as file:  # savez adds a suffix to a name, not to a file
        np.savez(file, **arrays)
