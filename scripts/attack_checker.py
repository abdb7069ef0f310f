"""Plants violations in valid plans, and asks the checker: JSON lines. Usage: attack_checker.py [--faults N] [--plans N]

Each violation is shown to be one before it counts, without the checker: contacts and margins by dense samples of the
native core's distances, all others by their construction. The valid plans must be accepted, the others refused by the
rule that their violation breaks; every rule of the checker has at least one kind of violation. The valid plans
are of all planners in turn, and their line has the number of each; violations are planted in plans of `rrt-connect`.
"""

from __future__ import annotations

import argparse
import copy
import itertools
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
from attacked_plan import Document
from figure import print_figure
from planted_violations import KINDS

import mmp_env
from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import Obstacle, check_plan, draw_problem, find_cell
from mmp_env.files.plan_check import plan_to_check
from mmp_env.importing.robot_folder import ImportOptions, add_robot
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.retime import retime
from mmp_planners import make, names

CELLS = ("ring-2", "ring-6", "ring-2-panda", "ring-4", "ring-2+held", "ring-2+exact", "ring-2+imported")
"""Cells. `held`: every arm holds a box. `exact`: the arms are convex hulls. `imported`: the arms are convex hulls of an
imported robot, which the plan carries."""
IMPORTED = Path(mmp_env.__file__).parent / "robots" / "piper" / "piper.xml"
QUICK, TIME_LIMIT_S = "rrt-connect", 2.0
"""Planner of plans in which violations are planted, and of those that another one does not find in time; limit [s]."""
KNOWN_PLANS = 80
"""Number of plans in which violations are planted."""


def main() -> int:
    """Prints how many violations of each kind were planted and found. Returns 1 if one was missed."""
    parser = Parser("attack_checker.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=whole, default=10_000, metavar="N", help="violations (default: 10000)")
    parser.add_argument("--plans", type=whole, default=1000, metavar="N", help="valid plans (default: 1000)")
    parser.add_argument("--workers", type=whole, default=2, metavar="N", help="processes (default: 2)")
    args = parser.parse()
    planted, found, missed = Counter[str](), Counter[str](), []
    with ProcessPoolExecutor(args.workers) as pool:
        valid = Counter(planner for planner in pool.map(accepted, range(args.plans), chunksize=10) if planner)
        for kind, refused, words in pool.map(attacked, range(args.faults), chunksize=25):
            planted[kind] += 1
            found[kind] += refused
            if not refused:
                missed.append(f"{kind}: {words}")
    for kind in KINDS:
        print_figure(f"checker_{kind}", found[kind], "violations", planted=planted[kind])
    print_figure("checker_violations", sum(found.values()), "violations", planted=args.faults)
    print_figure("checker_plans", valid.total(), "valid plans accepted", plans=args.plans, planners=dict(valid))
    for line in missed:
        print(f"# missed {line}")
    return int(bool(missed) or valid.total() < args.plans)


def accepted(number: int) -> str | None:
    """Returns the planner of a valid plan, or None if the checker refuses the plan."""
    planner, given = planned(number, names()[number % len(names())])
    return planner if check_plan(given).valid else None


def attacked(number: int) -> tuple[str, bool, str]:
    """Returns the kind of a planted violation, whether the checker reports the rule that it breaks, and its number."""
    for attempt in itertools.count():
        rng = np.random.default_rng((number, attempt))
        kind = list(KINDS)[number % len(KINDS)]
        given = copy.deepcopy(planned(int(rng.integers(KNOWN_PLANS)), QUICK)[1])
        if KINDS[kind].plant(given, rng):
            broken = {violation.rule for violation in check_plan(given).violations}
            return kind, KINDS[kind].rule in broken, f"{number}, attempt {attempt}"
    raise AssertionError


@cache
def cell_of(name: str) -> Cell:
    """Returns one of `CELLS`."""
    name, _, how = name.partition("+")
    if how == "imported":
        with tempfile.TemporaryDirectory() as folder:
            options = ImportOptions(name="imported")
            add_robot(IMPORTED, Path(folder), options, cache=None, progress=lambda line: None)
            return find_cell(name, robot=f"{folder}/imported")
    cell = find_cell(name, spheres=how if how == "exact" else None)
    return holding(cell) if how == "held" else cell


def holding(cell: Cell) -> Cell:
    """Returns the cell in which every arm holds a box."""
    box = Obstacle(
        name="held",
        shape="box",
        position=np.array([0.0, 0.0, 0.06]),
        quaternion=np.array([1.0, 0, 0, 0]),
        size=np.array([0.06, 0.06, 0.1]),
    )
    arms = [
        Arm(name=a.name, robot=a.robot, tool=a.tool, position=a.position, quaternion=a.quaternion, held=box)
        for a in cell.arms
    ]
    return Cell(name="held", arms=tuple(arms), obstacles=cell.obstacles)


@cache
def planned(number: int, planner: str) -> tuple[str, Document]:
    """Returns a planner, `QUICK` if the given one finds no plan, and a plan of it; every second plan is retimed."""
    for attempt in itertools.count():
        problem = draw_problem(cell_of(CELLS[number % len(CELLS)]), "crossing", 1000 * attempt + number)
        plan = make(planner).plan(problem, seed=number, time_limit=TIME_LIMIT_S).plan
        if plan is not None and plan.cost_rad > 0:
            return planner, plan_to_check(retime(plan, rate=50.0) if number % 2 else plan)
        planner = QUICK
    raise AssertionError


if __name__ == "__main__":
    run_script(main)
