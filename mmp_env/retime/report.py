"""What became of a plan that was retimed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class RetimeReport:
    """What became of a plan.

    Makespans [s]: `given_s` of the plan as it was, `fastest_s` at its velocity limits and on its corners, which no
    motion of its path beats; `smoothed_s` the same of the smoothed path, `makespan_s` of the result. The path was
    allowed to stray by `tolerance_rad` and strays by `deviation_rad`; `stops` of its `corners` are not rounded.
    `clearance_m` is proved of the result at every instant. `seconds`: wall-clock time that it took.
    """

    given_s: float
    fastest_s: float
    smoothed_s: float
    makespan_s: float
    tolerance_rad: float
    deviation_rad: float
    corners: int
    stops: int
    clearance_m: float
    seconds: float

    @property
    def ratio(self) -> float:
        """Of the makespan to that which velocities alone allow."""
        return self.makespan_s / self.fastest_s if self.fastest_s > 0 else 1.0
