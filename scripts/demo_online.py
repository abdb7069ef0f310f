"""Eight arms keep working while a box is carried through their cell: planned online, checked, executed in MuJoCo.

The arms get new goals when they have reached theirs, and `OnlinePlanner.replan` is called ten times a second. Every
50th answer is checked again by the independent checker; the longest of them can be saved for `mmp check`. In the end
MuJoCo executes all that the arms did, with the box.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from moving_box import CALLS_S, EDGE_M, SPEED, Record, least_clearances, run

import mmp_env
from mmp_cli.arguments import Parser, output, positive, seconds, seed
from mmp_cli.main import run_script
from mmp_env.files.writing import check_writable
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.retime.limits import split
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.simulation import Simulation

CHECKED = 50
"""Every so many answers one is checked."""
SHOWN_S = 0.04
"""The execution moves the box once in this time [s]."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the demonstration. Returns 0 if every answer was proved and nothing touched, 1 otherwise."""
    parser = Parser("demo_online.py", __doc__)
    help = "a cell that `mmp list` names; default: ring-8"
    parser.add_argument("--cell", default="ring-8", metavar="CELL", help=help)
    parser.add_argument("--seconds", type=positive, default=60.0, metavar="S", help="simulated time; default: 60")
    parser.add_argument("--within", type=seconds, default=0.05, metavar="S", help="time for an answer; default: 0.05")
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help="draws the goals and the way of the box")
    help = "write the longest motion that was checked, with the box (schema mmp-plan/1)"
    parser.add_argument("--out", type=output, metavar="FILE", help=help)
    args = parser.parse(arguments)
    if args.out:
        check_writable(args.out)
    cell = mmp_env.find_cell(args.cell)
    calls = max(round(args.seconds / CALLS_S), 2)
    record, valid, checked = Record(), 0, list[Plan]()
    for k, record in enumerate(itertools.islice(run(cell, args.within, args.seed), calls)):
        if record.committed is not None and k % CHECKED == 0:
            checked.append(record.committed())
            valid += mmp_env.check_plan(checked[-1]).valid
        if sys.stderr.isatty():
            print(f"\r{k + 1} of {calls} answers", end="", file=sys.stderr)
    slowest = 1e3 * max(step.seconds for step in record.steps)
    goes_on = sum(step.kind == "continuation" for step in record.steps)
    moving, standing = least_clearances(cell, record)
    print(f"\ranswers    {calls} in {CALLS_S * calls:g} s, {goes_on} of them continuations; slowest {slowest:.0f} ms")
    print(f"goals      reached {record.reached} times by all {len(cell.arms)} arms")
    print(f"box        {SPEED:g} m/s at most; {1e3 * moving:.0f} mm or more from arms that move,")
    print(f"           {1e3 * standing:.0f} mm or more from arms that stand")
    print(f"check      {valid} of {len(checked)} answers valid")
    simulation, plan, carry_box = execution_of(cell, record)
    execution = execute_plan(simulation, plan, show=carry_box)
    contacts = f"{len(execution.contacts)} contacts" if execution.contacts else "no contact"
    print(f"execution  {execution.duration_s:.1f} s of simulated time, {contacts}")
    if args.out:
        mmp_env.save_plan(max(checked, key=lambda each: each.makespan_s), args.out)
        print(f"plan file  {args.out}")
    return 0 if valid == len(checked) and not record.unproved and not execution.contacts else 1


def execution_of(cell: Cell, record: Record) -> tuple[Simulation, Plan, Callable[[], None]]:
    """Returns what executes all that the arms did: a simulation with the box, the motion, and what carries the box.

    The last one is to be called every `SHOWN_S` of simulated time.
    """
    q = np.concatenate(record.q)
    rows = {name: np.ascontiguousarray(part) for name, part in split(cell, q).items()}
    first, last = ({name: part[k] for name, part in rows.items()} for k in (0, -1))
    box = mmp_env.Obstacle(
        name="box", shape="box", position=record.box[0], quaternion=np.array([1.0, 0, 0, 0]), size=np.full(3, EDGE_M)
    )
    among = replace(cell, obstacles=(*cell.obstacles, box))
    problem = replace(mmp_env.make_problem(among, first, first), goal=last, goals={})
    plan = Plan(problem=problem, times=0.01 * np.arange(len(q)), positions=rows)
    simulation = Simulation(among)
    model, number = simulation.scene_model, simulation.scene_model.geom("obstacle/box").id
    shown = itertools.count(1)

    def carry_box() -> None:
        model.geom_pos[number] = record.box[min(round(next(shown) * SHOWN_S / 0.01), len(record.box) - 1)]

    return simulation, plan, carry_box


if __name__ == "__main__":
    run_script(main)
