"""The place of a cell's joints in the MuJoCo model that the cell was made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.model.read_only import ReadOnly


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelJoints(ReadOnly):
    """Joints of a MuJoCo model that are those of the arms of a cell.

    Attributes:
        names: arm name -> names of its joints in the model.
        addresses: arm name -> indices of its joints in `qpos`.
        qpos: configuration of the model in which the cell was made: the values of joints that no arm has.
    """

    names: Mapping[str, tuple[str, ...]]
    addresses: Mapping[str, tuple[int, ...]]
    qpos: Float[np.ndarray, "nq"]

    def configurations(self, qpos: Float[np.ndarray, "nq"]) -> dict[str, Float[np.ndarray, "dof"]]:
        """Returns arm name -> [dof] of a configuration of the whole model."""
        return {arm: qpos[list(indices)] for arm, indices in self.addresses.items()}

    def with_arms(self, q: Mapping[str, ArrayLike]) -> Float[np.ndarray, "nq"]:
        """Returns the configuration of the whole model with the arms at `q`."""
        out = self.qpos.copy()
        for arm, indices in self.addresses.items():
            out[list(indices)] = q[arm]
        return out

    def deviation(self, qpos: Float[np.ndarray, "nq"]) -> tuple[int, float]:
        """Returns the index of `qpos` that differs most among those of no arm, and the difference."""
        away = np.abs(qpos - self.qpos)
        away[[k for indices in self.addresses.values() for k in indices]] = 0.0
        worst = int(np.argmax(away)) if len(away) else 0
        return worst, float(away[worst]) if len(away) else 0.0
