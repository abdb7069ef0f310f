"""What `scripts/measure.py` runs: benchmarks with sources, planners and options, and scripts that print figures."""

from __future__ import annotations

from study import long_variants, study_variants

RINGS = ("MultiArmCell-4", "MultiArmCell-6", "MultiArmCell-8")
CIRCLES = ("panda-circle-2", "panda-circle-4", "panda-circle-6")
FIVE = "cbs,ecbs,gen-ecbs,apf-ecbs-nf,apf-ecbs"
"""Planners of the paper."""
TASKS = ("crossing", "parallel", "pick", "place", "packing")
KINDS = ("vertex", "avoid-path", "sphere", "priority", "priority-path", "split")

_TREE_PAPER = "restarts=off patience=1000000 direct=off static_tree=off improve=200 shortcuts=0"
"""Settings of the paper of any planner with a conflict tree."""
_ECBS_PAPER = f"constraint=vertex {_TREE_PAPER}"
PRESET = {
    "ecbs-paper": _ECBS_PAPER,
    "apf-ecbs-nf-paper": "preset=paper",
    "paper": "preset=paper",
    "gen-ecbs-paper": _TREE_PAPER,
}
"""Options of the paper's planners with the settings of the paper; Gen-ECBS has its own constraint kinds."""
VARIANTS = {
    "apf-ecbs": "",
    "gradient": "step=gradient",
    "centre": "distance=centre step=gradient",
    "all-iterations": "early_stop=off",
    "improve": "improve=200",
    "one-arm": "critical_arms=one misses=discarded",
    "cover": "critical_arms=cover",
    "discarded": "misses=discarded",
    "at-expansion": "fast_track_at=expansion",
    "literal-track": "fast_track=literal fast_track_at=expansion critical_arms=one misses=discarded",
    "vertex": "constraint=vertex",
    "vertex-0.05": "constraint=vertex radius=0.05",
    "one-tree": "restarts=off",
    "paper": "preset=paper",
    "paper-surface": "preset=paper distance=surface floor=0.01",
    "paper-avoid-state": "preset=paper constraint=avoid-state",
    "paper-restarts": "preset=paper restarts=on",
    "ecbs": "",
    "ecbs-improve": "improve=200",
    "ecbs-paper": _ECBS_PAPER,
}
"""Options of each variant of `apf-ecbs`, and of `ecbs` if its name begins so; `apf-ecbs` and `ecbs` have defaults.

The first group reverts one design decision or a few that belong together. `paper` reverts all that have an option,
`paper-...` all but one, `paper-surface` all but the distance and its floor.
"""
DECISIONS = {
    "apf-ecbs": "",
    "centre-distance": "distance=centre",
    "no-floor": "floor=0",
    "no-cap": "cap=0",
    "no-stretch": "stretch=0",
    "no-direct": "direct=off",
    "no-static-tree": "static_tree=off",
    "no-shortcuts": "shortcuts=0",
    "patience": "patience=1000000",
    "literal-hits": "fast_track=literal",
    "earliest-conflict": "conflict_choice=earliest",
    "constant-pad": "pad_growth=1",
    "w-1.2": "w=1.2",
    "w-2": "w=2",
    "alpha-10": "step=gradient alpha=1e-6",
    "k_rep-10": "step=gradient k_rep=0.5",
    "gradient-no-cap": "step=gradient cap=0",
}
"""Options of further variants: each reverts one design decision, or has another value of a published parameter."""
TRACK = {
    "apf-ecbs-nf": "",
    **{label: VARIANTS[label] for label in ("one-arm", "cover", "discarded", "at-expansion", "literal-track")},
    "apf-ecbs": "",
}
"""Options of the fast tracks that are compared with six and eight arms."""


def planner_of(label: str) -> str:
    """Returns the name of the planner of a label: it begins with it, or belongs to `apf-ecbs`."""
    return next((name for name in ("ecbs", "apf-ecbs-nf", "gen-ecbs") if label.startswith(name)), "apf-ecbs")


def variants(options: dict[str, str]) -> list[str]:
    """Returns the arguments of `mmp bench` for labels of planners and their options."""
    planners, settings = [], []
    for label, words in options.items():
        name = planner_of(label)
        planners.append(label if label == name else f"{label}={name}")
        settings += [word for setting in words.split() for word in ("--set", f"{label}.{setting}")]
    return ["--planners", ",".join(planners), *settings]


BENCHES: dict[str, dict[str, list[str]]] = {
    "cells": {"cells": [*RINGS, "--planners", FIVE]},
    "kinds": {
        "kinds": [
            "MultiArmCell-4",
            *("--planners", ",".join(["avoid-state=ecbs", *(f"{kind}=ecbs" for kind in KINDS)])),
            *(word for kind in KINDS for word in ("--set", f"{kind}.constraint={kind}")),
        ],
    },
    "tasks": {
        f"task-{task}": ["MultiArmCell-mixed-4", "--task", task, "--planners", "auto,apf-ecbs,prioritized"]
        for task in TASKS
    },
    "literal": {
        "literal": ["MultiArmCell-4", *variants(VARIANTS)],
        "decisions": ["MultiArmCell-4", *variants(DECISIONS)],
        "track": [*RINGS[1:], *variants(TRACK)],
    },
    "others": {
        "others": [*RINGS, "--planners", "auto,group-rrt,rrt-connect,prioritized,xecbs", "--exact"],
        "cbs-mp": ["MultiArmCell-4", "--planners", "cbs-mp", "--exact"],
    },
    "panda": {
        "panda": [
            *("MultiArmCell-8", "--robot", "panda", "--exact"),
            *("--planners", "auto,group-rrt,rrt-connect,prioritized,ecbs,apf-ecbs-nf,apf-ecbs"),
        ],
    },
    "preset": {
        "preset": [*RINGS, *variants(PRESET)],
    },
    "study": {
        "study": [*RINGS, *variants(study_variants(_ECBS_PAPER))],
        "study-long": [*RINGS, *variants(long_variants(_ECBS_PAPER))],
    },
    "circles": {
        "circles": [*CIRCLES, "--planners", f"auto,group-rrt,rrt-connect,prioritized,{FIVE},cbs-mp,xecbs", "--exact"],
    },
}
"""Part -> folder -> arguments of `mmp bench`."""
COUNTS = {"kinds": 20, "preset": 20, "track": 20}
"""Largest number of instances of a cell; the other folders have no limit."""
SHARES = {"study": (0.2, 0.3), "study-long": (0.1, 60.0)}
"""Instances of a cell and time limit of a folder, relative to those of the others."""
REPORTED = {"cells": "The paper's five planners", "literal": "Paper-literal settings and our design decisions"}
"""Title of the report of each folder that has one."""

_REPULSION = {
    "fast-track": [
        ["--planner", name, "--base", name, "--set", "repulsion=fast-track", "--count", "20"]
        for name in ("xecbs", "gen-ecbs", "cbs")
    ],
    "options": [
        ["--base", "apf-ecbs", "--set", setting]
        for setting in (
            *("shorten_paths=on", "shorten=25", "shorten=100", "shorten=400", "parked_yield=on", "halvings=3"),
        )
    ],
    "ecbs": [["--planner", "ecbs", "--base", "ecbs", "--set", "shorten=400"]],
    "choice": [
        [*cells, "--base", "apf-ecbs", "--set", "fast_track_at=expansion", "--first", "1000", "--count", count]
        for cells, count in (((), "300"), (("line-16", "line-32", "line-64"), "20"))
    ]
    + [
        [*cells, "--base", "apf-ecbs", "--set", setting, "--first", "1000", "--count", count]
        for setting in ("conflict_choice=earliest", "pad_growth=1")
        for cells, count in (((), "150"), (("line-64",), "20"))
    ]
    + [
        ["--base", "apf-ecbs", "--set", setting, "--first", "1000", "--count", "150"]
        for setting in ("last_resort=off", "static_tree=off", "floor=0")
    ],
    "exact": [["--base", "apf-ecbs", "--set", "exact_within=0.03", "--exact"]],
}
"""Arguments of the runs of `bench_repulsion.py`: planners with repulsion, options of `apf-ecbs`, and a control."""

_SMALL = (
    *("import", "core", "anytime", "env", "goals", "growth", "harness", "rerun", "retime", "tasks"),
    *("work", "online", "batched", "clone"),
)
_EACH_CALL = (
    *("plan", "json", "bench", "report", "csv", "npz", "trajectory", "scene", "run", "dataset", "replace", "robot"),
    *("rerun", "video"),
)
"""Commands of `faults.sh` each of whose calls fails once."""
_SECOND_FUZZING = ("--figure", "fuzz_command_lines_again")
"""Arguments of the second run of `fuzz.sh`."""
LINES: dict[str, dict[str, list[list[str]]]] = {
    "small": {name: [[f"bench_{name}.py"]] for name in _SMALL} | {"portfolio": [["bench_portfolio.py", "--limits"]]},
    "beyond": {
        "nodes": [["bench_nodes.py"]],
        **{
            f"repulsion-{name}": [["bench_repulsion.py", *words] for words in runs] for name, runs in _REPULSION.items()
        },
    },
    "attacks": {
        "deadlines": [["bench_deadlines.py", "--most", "10", "--count", "3"]],
        "soak": [["soak.py"]],
        "checker": [["attack_checker.py"]],
        "fuzz": [
            ["fuzz.sh", "--minutes", "66", "--core-share", "0.03"],
            ["fuzz.sh", "--minutes", "29", "--core-share", "0.03", "--workers", "1", *_SECOND_FUZZING],
        ],
        "sanitizers": [["sanitize.sh"]],
        "faults": [
            ["faults.sh", "--most", "3"],
            ["faults.sh", "--figure", "faults_of_all_calls", *_EACH_CALL],
        ],
        "wheel": [["wheel.sh", "--cold"], ["wheel.sh", "--warm"]],
    },
}
"""Part -> output -> commands, whose lines in JSON go into figures.jsonl."""
PARTS = (*LINES, *BENCHES, "pages")
"""Parts of `scripts/measure.py`, in their order."""
REPRODUCED = ("cells", "kinds", "tasks", "literal", "others", "panda", "preset", "study", "beyond")
"""Parts that `scripts/reproduce_paper.sh` runs by default."""
