"""A plan as a document, as the violations of `planted_violations.py` read and change it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mmp_env.files.cell_file import cell_from_dict
from mmp_env.model.cell import Cell

Document = dict[str, Any]
Rng = np.random.Generator
Plant = Callable[[Document, Rng], bool]
"""Plants a violation in a document. Returns whether it surely is one."""
DENSE = 400
"""Least number of samples of a motion."""


def rows_of(given: Document, key: str = "positions") -> dict[str, np.ndarray]:
    """Returns arm name -> configurations, or another property of all joints at all times."""
    return {name: np.array(rows, dtype=float) for name, rows in given[key].items()}


def dense(q: np.ndarray) -> np.ndarray:
    """Returns configurations on the lines between the given ones."""
    at = np.linspace(0, len(q) - 1, max(DENSE, 4 * len(q)))
    return np.column_stack([np.interp(at, np.arange(len(q)), column) for column in q.T])


def meant_cell(given: Document) -> Cell:
    """Returns the cell of a document."""
    return cell_from_dict(given["problem"]["cell"], "plan", name="cell")


def any_arm(given: Document, rng: Rng) -> str:
    """Returns the name of an arm."""
    return str(rng.choice(sorted(given["positions"])))


def is_retimed(given: Document) -> bool:
    """Returns whether a plan states velocities."""
    return "velocities" in given
