"""Values of command line options that the fuzzer draws."""

from __future__ import annotations

from mmp_planners import names

ARGUMENTS = [
    *("", "0", "-1", "1e300", "nan", "inf", "1e-300", "x", "@missing.json", "@cell.json", "{", "[]", "null"),
    *("\u202e", "a=b", "ecbs", "ecbs,ecbs", "w=1.1", "w=0", "shortcuts=-1", "1,2", "left", "left=home"),
    *("arms=0.01", "arms=-1", "home", "/"),
]
"""Values in place of any argument of an option."""
PLANNERS = names()
OWN_ARGUMENTS = {
    "--rerun": ["out.rrd", "none/out.rrd", "cell.json"],
    "--memory-limit": ["1", "300", "100000", "99999999999"],
    "--planner": PLANNERS,
    "--planners": ["auto,ecbs", "a=auto,b=auto", "prioritized", "rrt-connect,x=group-rrt"],
    "--reference": PLANNERS,
    "--robot": ["ur5e", "panda", "fr5", "piper"],
    "--task": ["reach", "crossing", "parallel", "pick", "place", "packing"],
    "--control-mode": ["position", "velocity", "delta"],
    "--format": ["npz", "minari"],
    "--instance": ["turn", "0"],
    "--count": ["1", "2", "3"],
    "--workers": ["1", "2", "3"],
    "--seed": ["1", "77", "4294967295", "18446744073709551615"],
    "--to": ["out.csv", "out.npz", "out.xml", "out.yaml", "{arm}.csv", "out.json", "none/out.npz"],
    "--tree": ["out.svg", "out.json", "none/out.svg"],
    "--start": ["home", "tucked", "@ends.json"],
    "--goal": ["home", "tucked", "stay", "@goal.json", "@ends.json"],
    "--margin": ["0.001", "0.004", "0.05"],
    "--tolerance": ["0.001", "0.02", "0.3"],
    "--rate": ["1", "50", "1000"],
    "--max-velocity": ["0.2", "1.5"],
    "--max-acceleration": ["0.5", "20"],
    "--max-jerk": ["5", "5000"],
    "--improve": ["0.05", "0.2"],
    "--delays": ["0.05", "0.5"],
    "--joint-names": ["{arm}_{joint}", "{joint}", "{arm}/{number}", "{arm", "{other}"],
    "--name": ["other", "small", "ur5e"],
    "--state": ["open=0.04", "open=slide=0.04", "closed=0"],
    "--tip": ["grasp", "palm", "finger", "tip"],
}
"""Option -> values that mean something to it. They are drawn as often as `ARGUMENTS`."""
