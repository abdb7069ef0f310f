"""The command lines whose calls fail, and how they are started."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

PLAN = ["plan", "instances.json", "--instance", "turn", "--planner", "ecbs"]
BENCH = ["bench", "instances.json", "--workers", "1", "--out", "bench", "--planners"]
DATASET = ["dataset", "cell.json", "--count", "2", "--out", "data"]
ROBOT = ["robot", "add", "small.urdf", "--name", "small", "--out", "robots"]


@dataclass(frozen=True)
class Command:
    """A command line of `mmp`.

    Attributes:
        line: its arguments.
        adds: its files that keep what they had when the command runs once more.
        done: pattern of the lines of standard error that report how many entries those files have.
        first: a line that runs before, where nothing fails.
        program: the program that runs the line.
    """

    line: list[str]
    adds: tuple[str, ...] = ()
    done: str = ""
    first: list[str] = field(default_factory=list)
    program: list[str] = field(
        default_factory=lambda: [
            sys.executable,
            "-P",
            "-c",
            "import sys; from mmp_cli.main import main; sys.exit(main())",
        ]
    )


_RUNS, _EPISODES = r"^mmp bench: (\d+) of \d+ done", r"^mmp: (\d+) of \d+: "
COMMANDS = {
    "plan": Command([*PLAN, "--out", "plan-out.json", "--tree", "tree.svg"]),
    "json": Command([*PLAN, "--json"]),
    "rerun": Command([*PLAN, "--rerun", "search.rrd"]),
    "image": Command([*PLAN, "--image", "plan.png"]),
    "video": Command([*PLAN, "--video", "film.mp4"]),
    "gif": Command([*PLAN, "--video", "film.gif"]),
    "bench": Command([*BENCH, "ecbs,rrt-connect"], adds=("bench/results.jsonl",), done=_RUNS),
    "grow": Command(
        [*BENCH, "ecbs,rrt-connect"], adds=("bench/results.jsonl",), done=_RUNS, first=[*BENCH, "rrt-connect"]
    ),
    "report": Command(["report", "results"]),
    "csv": Command(["export", "plan.json", "--to", "out.csv"]),
    "npz": Command(["export", "plan.json", "--to", "out.npz"]),
    "trajectory": Command(["export", "plan.json", "--to", "out.yaml"]),
    "scene": Command(["export", "plan.json", "--to", "out.xml"]),
    "run": Command(["run", "jobs.json", "--out", "schedule-out.json", "--seed", "1"]),
    "dataset": Command(DATASET, adds=("data/dataset.json",), done=_EPISODES),
    "minari": Command([*DATASET, "--format", "minari"]),
    "replace": Command(ROBOT, first=ROBOT),
    "robot": Command(ROBOT),
    "tool": Command(["tool", "add", "gripper.xml", "--name", "gripper", "--out", "tools"]),
}
"""Name -> command line. Its inputs are those of the fuzzer."""
