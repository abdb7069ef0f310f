"""Retiming: rounds the corners of plans and times them within velocity, acceleration and jerk limits.

All arms move along one common phase, and only its clock changes, so a plan stays free of conflicts. `course` is the
plan over its phase. `blends` and `smoothing` round its corners for a `pace`. `zones` computes the limits of the clock,
`clock` runs it, and `proof` proves the result. docs/how-to/retime.md describes the method.
"""

from mmp_env.retime.options import RetimeOptions
from mmp_env.retime.retiming import RetimeReport, retime, retime_with_report

__all__ = ["RetimeOptions", "RetimeReport", "retime", "retime_with_report"]
