"""Nonsense in the arrays of an episode, by docs/how-to/learn-from-experts.md. It shares no code with the program."""

from __future__ import annotations

import io
import zipfile

import numpy as np

PARTS = ("joint_positions", "joint_velocities", "tool_positions", "clearance", "goal_positions")
"""Quantities in an observation."""
KINDS = {
    **{f"observations.{name}": "f8" for name in PARTS},
    **dict.fromkeys(("terminations", "truncations", "infos.is_success"), "b1"),
    **dict.fromkeys(("rewards", "infos.distance_rad"), "f8"),
    "actions": "f4",
    "infos.contacts": "i8",
}
"""Name of an array -> kind and size of its numbers."""


def episode_nonsense(content: bytes) -> list[str]:
    """Returns why no program may accept the file of an episode."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            names = archive.namelist()
        with np.load(io.BytesIO(content)) as file:
            arrays = dict(file)
    except Exception as error:  # the reader of a damaged file may raise anything
        return [f"not an episode: {error}"]
    if sorted(names) != sorted(f"{name}.npy" for name in KINDS):
        return [f"arrays {names}"]
    out = [f"{name} of {arrays[name].dtype}" for name, kind in KINDS.items() if arrays[name].dtype.str[1:] != kind]
    return out or _numbers_nonsense(arrays)


def _numbers_nonsense(arrays: dict[str, np.ndarray]) -> list[str]:
    """Returns wrong shapes and numbers in the arrays of an episode, which all have their names and kinds."""
    out = [f"{name} that is not finite" for name, rows in arrays.items() if not np.isfinite(rows).all()]
    actions, tools = arrays["actions"], arrays["observations.tool_positions"]
    if actions.ndim != 2 or tools.ndim != 3:
        return [*out, f"actions {actions.shape}, tools {tools.shape}"]
    steps, joints = actions.shape
    parts = dict.fromkeys(("joint_positions", "joint_velocities", "goal_positions"), (joints,))
    parts |= {"tool_positions": (tools.shape[1], 3), "clearance": (1,)}
    wanted = dict.fromkeys(arrays, (steps,)) | {"actions": (steps, joints)}
    wanted |= {f"observations.{name}": (steps + 1, *shape) for name, shape in parts.items()}
    out += [f"{name} {rows.shape}" for name, rows in arrays.items() if rows.shape != wanted[name]]
    if not 0 < joints >= tools.shape[1] > 0:
        out.append(f"{joints} joints, {tools.shape[1]} tools")
    if (abs(actions) > 1).any():
        out.append("actions beyond 1")
    if (arrays["infos.distance_rad"] < 0).any() or (arrays["infos.contacts"] < 0).any():
        out.append("a distance or a number of contacts below 0")
    if np.flatnonzero(arrays["terminations"]).tolist() != [steps - 1] or arrays["truncations"].any():
        out.append("an end before the last step, or none")
    return out
