"""Figures about goals that are tool poses: JSON lines. Usage: bench_goals.py [--parts PART...] [--poses N]

Part `branches`: how many of the configurations that random restarts of a numeric solver find are among those of
`mmp_env.ik.branches`, their errors by MuJoCo's kinematics, and the time for a pose, for each robot.

Part `poses`: plans of `auto` in rings of UR5e with the poses of the tools as goals beside those with the joint goals:
solved, cost, the time of `make_problem`, and that of the planner until its first plan and until its end. All times are
processor times.
"""

from __future__ import annotations

import argparse

from goal_figures import branches, poses

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import robot_names
from mmp_env.errors import UnknownNameError

PARTS = ("branches", "poses")
BUILT_IN = ("ur5e", "fr5", "piper", "panda")


def main() -> None:
    """Prints the figures of each part."""
    parser = Parser("bench_goals.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", default=PARTS, metavar="PART", help=f"{', '.join(PARTS)} (default: all)")
    parser.add_argument("--poses", type=whole, default=1000, metavar="N", help="poses of a robot (default: 1000)")
    parser.add_argument("--arms", nargs="+", type=whole, default=(4, 8), metavar="N", help="arms (default: 4 8)")
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="instances (default: 50)")
    parser.add_argument("--robots", nargs="+", default=BUILT_IN, metavar="NAME", help="robots (default: the built-in)")
    args = parser.parse()
    for name in args.parts:
        if name not in PARTS:
            raise UnknownNameError("part", name, PARTS)
    for name in args.robots:
        if name not in robot_names():
            raise UnknownNameError("robot", name, robot_names())
    if "branches" in args.parts:
        for name in args.robots:
            branches.measure(name, args.poses)
    if "poses" in args.parts:
        for arms in args.arms:
            poses.measure(arms, args.count)


if __name__ == "__main__":
    run_script(main)
