"""What an execution asked of the motors: the largest torques against the robots' ratings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.sim.simulation import Simulation


@dataclass(frozen=True, kw_only=True)
class Load:
    """The joint (from 1) of an arm with the largest torque for its rating: `torque_nm` of `rated_nm`, a `share` of it.

    The torque is all that the motor gives, gravity included. Servos here have no force limit
    (docs/reference/robots.md), so the share may be above 1, where a real arm could not have followed.
    """

    joint: int
    torque_nm: float
    rated_nm: float

    @property
    def share(self) -> float:
        return self.torque_nm / self.rated_nm


def loads_of(simulation: Simulation) -> dict[str, Load]:
    """Arm name -> its largest load since the log began."""
    out = {}
    for arm in simulation.cell.arms:
        torques = simulation.largest_torques[simulation.slices[arm.name]]
        k = int(np.argmax(torques / arm.robot.effort))
        out[arm.name] = Load(joint=k + 1, torque_nm=float(torques[k]), rated_nm=float(arm.robot.effort[k]))
    return out
