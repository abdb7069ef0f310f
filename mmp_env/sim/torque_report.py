"""Largest torques of an execution, relative to the ratings of the robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.sim.driven import Driven


@dataclass(frozen=True, kw_only=True)
class PeakTorque:
    """The joint (from 1) of an arm with the largest torque `torque_nm` relative to its rating `rated_nm` [N m].

    Both are forces [N] if the joint slides. The torque is that of the motor, gravity included. Servos here have no
    force limit (docs/reference/robots.md). A `share` above 1 means that a real arm could not have followed.
    """

    joint: int
    torque_nm: float
    rated_nm: float

    @property
    def share(self) -> float:
        """Torque relative to the rating."""
        return self.torque_nm / self.rated_nm


def peak_torques(simulation: Driven) -> dict[str, PeakTorque]:
    """Returns the largest torque of each arm since the log of the simulation began, arm name -> torque."""
    out = {}
    for arm in simulation.cell.arms:
        torques = simulation.largest_torques[simulation.slices[arm.name]]
        k = int(np.argmax(torques / arm.robot.effort))
        out[arm.name] = PeakTorque(joint=k + 1, torque_nm=float(torques[k]), rated_nm=float(arm.robot.effort[k]))
    return out
