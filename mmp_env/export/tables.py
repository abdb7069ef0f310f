"""Motions as CSV and as NumPy archives."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.export.motion import Motion

DERIVATIVES = {"velocities": "velocity", "accelerations": "acceleration"}


def csv_text(motion: Motion) -> str:
    """A row for each time: `time` [s], then a column for each joint [rad].

    A retimed motion has the velocities [rad/s] and accelerations [rad/s^2] behind, as `<joint>/velocity` and so on.
    Numbers are in the shortest form that reads back the same.
    """
    header, columns = ["time", *motion.joints], [motion.times[:, None], motion.joined("positions")]
    for key, word in DERIVATIVES.items():
        values = motion.joined(key)
        if values is not None:
            header += [f"{name}/{word}" for name in motion.joints]
            columns.append(values)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(np.concatenate(columns, axis=1).tolist())
    return text.getvalue()


def write_npz(motion: Motion, path: Path) -> None:
    """Arrays `times` [t], `arms`, and of each arm `<arm>/joints`, `<arm>/positions` [t, dof], and so on."""
    arrays: dict[str, Any] = {"times": motion.times, "arms": np.array(list(motion.arms))}
    for name, arm in motion.arms.items():
        arrays[f"{name}/joints"] = np.array(arm.joints)
        for key in ("positions", *DERIVATIVES):
            values = getattr(arm, key)
            if values is not None:
                arrays[f"{name}/{key}"] = values
    with path.open("wb") as file:  # given a name, savez would add its own suffix
        np.savez(file, **arrays)
