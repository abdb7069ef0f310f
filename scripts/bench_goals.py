"""Figures about goals that are tool poses: JSON lines. Usage: bench_goals.py [--parts PART...] [--poses N]

Part `branches`: how many of the configurations that random restarts of a numeric solver find are among those of
`mmp_env.ik.branches`, their errors by MuJoCo's kinematics, and the time for a pose, for each robot.
"""

from __future__ import annotations

import argparse

from goal_figures import branches

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import robot_names
from mmp_env.errors import UnknownNameError

PARTS = ("branches",)
BUILT_IN = ("ur5e", "fr5", "piper", "panda")


def main() -> None:
    """Prints the figures of each part."""
    parser = Parser("bench_goals.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", default=PARTS, metavar="PART", help=f"{', '.join(PARTS)} (default: all)")
    parser.add_argument("--poses", type=whole, default=1000, metavar="N", help="poses of a robot (default: 1000)")
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


if __name__ == "__main__":
    run_script(main)
