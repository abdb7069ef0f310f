"""The command lines whose calls fail, and how they are started."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

PLAN = ["plan", "instances.json", "--instance", "turn", "--planner", "ecbs"]
BENCH = ["bench", "instances.json", "--workers", "1", "--out", "bench", "--planners"]
DATASET = ["dataset", "cell.json", "--count", "2", "--out", "data"]
ROBOT = ["robot", "add", "small.urdf", "--name", "small", "--out", "robots"]
OTHER_ROBOT = [*ROBOT, "--tip", "fore"]
"""Line that adds another robot of the same name."""


@dataclass(frozen=True)
class Command:
    """A command line of `mmp`.

    Attributes:
        line: its arguments.
        adds: its files that keep what they had when the command runs once more.
        done: pattern of the lines of standard error that report how many entries those files have.
        timed: its files with times of the run; numbers in them may differ.
        replaces: the folder that it replaces as a whole.
        depends: pattern of the lines of its output that depend on what an earlier run left.
        first: a line that runs before, where nothing fails.
        program: the program that runs the line.
    """

    line: list[str]
    adds: tuple[str, ...] = ()
    done: str = ""
    timed: tuple[str, ...] = ()
    replaces: str = ""
    depends: str = "(?!)"
    first: list[str] = field(default_factory=list)
    program: list[str] = field(
        default_factory=lambda: [
            sys.executable,
            "-P",
            "-c",
            "import sys; from mmp_cli.main import main; sys.exit(main())",
        ]
    )


_IMPORTED = "replaced|folder"
_INDEX = ("data/dataset.json",)
_RUNS, _EPISODES = r"^mmp bench: (\d+) of \d+ done", r"^mmp: (\d+) of \d+: "
COMMANDS = {
    "plan": Command([*PLAN, "--out", "plan-out.json", "--tree", "tree.svg"], timed=("tree.svg",)),
    "json": Command([*PLAN, "--json"]),
    "rerun": Command([*PLAN, "--rerun", "search.rrd"], timed=("search.rrd",)),
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
    "dataset": Command(DATASET, adds=_INDEX, done=_EPISODES),
    "minari": Command([*DATASET, "--format", "minari"], replaces="data/pair/expert-v0", adds=_INDEX, done=_EPISODES),
    "replace": Command(ROBOT, replaces="robots/small", depends=_IMPORTED, first=OTHER_ROBOT),
    "robot": Command(ROBOT, replaces="robots/small", depends=_IMPORTED),
    "tool": Command(
        ["tool", "add", "gripper.xml", "--name", "gripper", "--out", "tools"],
        replaces="tools/gripper",
        depends=_IMPORTED,
    ),
}
"""Name -> command line. Its inputs are those of the fuzzer."""
