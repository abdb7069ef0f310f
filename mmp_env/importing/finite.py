"""Refuses MuJoCo models with numbers that are not finite, or far too large."""

from __future__ import annotations

from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.mujoco_import import mujoco

LARGEST_M = 1e6
"""Largest coordinate and size of anything in a model [m]."""
_NUMBERS = {
    "body": ("body_pos", "body_quat"),
    "joint": ("jnt_pos", "jnt_axis"),
    "geom": ("geom_pos", "geom_quat", "geom_size"),
    "site": ("site_pos", "site_quat"),
    "mesh": ("mesh_pos", "mesh_quat"),
}
"""Kind of element -> arrays of a model with a row for each."""
_UNIT = {"jnt_axis", "body_quat", "geom_quat", "site_quat", "mesh_quat"}
"""Arrays whose rows have length 1."""
_ROUNDING = 1e-6


def require_finite_model(where: str, model: Any) -> None:
    """Raises `MmpError` if a place, size, rotation or axis in a model is not finite, or larger than `LARGEST_M`.

    No other number may be NaN.

    Args:
        where: the file or the model, for the message.
        model: a compiled `MjModel`.
    """
    for kind, arrays in _NUMBERS.items():
        for array in arrays:
            rows = np.asarray(getattr(model, array), dtype=float)
            if array in _UNIT:
                good = np.abs((rows**2).sum(axis=1) - 1) <= _ROUNDING
            else:
                good = (np.abs(rows) <= LARGEST_M).all(axis=1)
            if not good.all():  # NaN is not good either
                k = int(np.argmin(good))
                raise MmpError(
                    f"{where}: {array.partition('_')[2]} of {kind} '{_name(model, kind, k)}' is {_text(rows[k])};"
                    f" numbers must be finite, lengths within {LARGEST_M:g} m"
                )
    for array in dir(model):
        values = getattr(model, array, None) if not array.startswith("_") else None
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and np.isnan(values).any():
            raise MmpError(f"{where}: {array} holds NaN; no number of a model may be NaN")
    for array in ("qpos0", "mesh_vert"):
        if not (np.abs(getattr(model, array)) <= LARGEST_M).all():
            raise MmpError(f"{where}: {array} has numbers that are not finite, or beyond {LARGEST_M:g}")


def _name(model: Any, kind: str, number: int) -> str:
    kinds = mujoco.mjtObj
    known = {"body": kinds.mjOBJ_BODY, "joint": kinds.mjOBJ_JOINT, "geom": kinds.mjOBJ_GEOM, "site": kinds.mjOBJ_SITE}
    return mujoco.mj_id2name(model, known.get(kind, kinds.mjOBJ_MESH), number) or str(number)


def _text(row: np.ndarray) -> str:
    return "[" + ", ".join(f"{x:g}" for x in row) + "]"
