"""Plans that controllers accept: corners rounded, then timed within velocity, acceleration and jerk limits.

All arms move along one common phase and only its clock changes, so a plan stays conflict free. `course` is the plan
over its phase, `blends` and `smoothing` round its corners for a `pace`, `zones` says what limits leave the clock,
`clock` runs it, `proof` proves what comes out. docs/how-to/retime.md says it all.
"""

from mmp_env.retime.options import RetimeOptions
from mmp_env.retime.report import RetimeReport
from mmp_env.retime.retiming import retime, retime_with_report

__all__ = ["RetimeOptions", "RetimeReport", "retime", "retime_with_report"]
