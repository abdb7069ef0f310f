"""Arguments of another kind than allowed end with one sentence. A process of its own runs without the type checks."""

import subprocess
import sys

BEGIN = """
from dataclasses import replace
import numpy as np
import mmp_env as m
cell = m.find_cell("ring-2")
zero = {name: np.zeros(6) for name in cell.arm_names}
rows = {name: np.zeros((1, 6)) for name in cell.arm_names}
rest = m.Plan(problem=m.make_problem(cell, zero, zero), times=np.zeros(1), positions=rows)
"""
SENTENCES = {
    "m.Cell(name='c', arms=('arm0',))": "one of the arms is 'arm0'; it must be an Arm",
    "m.Cell(name='c', arms=3)": "arms is 3; it must be a tuple or list",
    "m.Cell(name='c', arms=cell.arms, obstacles=(3,))": "one of the obstacles is 3; it must be an Obstacle",
    "m.AnyOf(3)": "goals is 3; it must be a list of goals",
    "m.AnyOf(np.array(3.0))": "goals is array(3.); it must be a list of goals",
    "m.AnyOf('home')": "goals is 'home'; it must be a list of goals",
    "m.OnlinePlanner(cell, zero, clock=3)": "clock is 3; it must be a function that returns the time [s], or None",
    "m.Plan(problem=rest.problem, times=np.zeros(1), positions=3)": (
        "positions of a plan is 3; it must be a mapping from arm name to array"
    ),
    "print(m.check_plan(replace(rest, problem=None)).sentences[0])": (
        "schema: problem of a plan is None; it must be a Problem"
    ),
    "m.save_plan(replace(rest, times=None), 'p.json')": "times of a plan is None; it must be an array of times [s]",
    "m.save_plan(replace(rest, stats=5), 'p.json')": "stats of a plan is 5; it must be a mapping from name to value",
    "rest.at(float('nan'))": "t is nan; it must be a time [s]",
    "rest.at([0, 9])": "t is [0, 9]; it must be a time [s]",
    "m.save_plan(replace(rest, times=np.zeros(2)), 'p.json')": (
        "the plan cannot be saved: positions of arm 'arm0' has shape (1, 6); it must be (2, 6)"
    ),
    "m.save_plan(replace(rest, stats={'a': object()}), 'p.json')": (
        "the plan cannot be saved: a value of type object cannot be written as JSON"
    ),
    "rest.at(10**400)": "t is a number of 401 digits; it must be a time [s]",
    "m.save_plan(replace(rest, times=np.zeros((1, 1))), 'p.json')": (
        "the plan cannot be saved: times has shape (1, 1); it must be one row"
    ),
    "m.save_plan(replace(rest, positions={n: q.astype(object) for n, q in rows.items()}), 'p.json')": (
        "the plan cannot be saved: its positions of arm 'arm0' are not numbers"
    ),
    "m.save_plan(replace(rest, accelerations=rows), 'p.json')": (
        "the plan cannot be saved: it has accelerations and no velocities"
    ),
    "print(m.check_plan(replace(rest, stats={'a': object()})).sentences[0])": (
        "schema: a value of type object cannot be written as JSON"
    ),
    "m.save_picture(rest, 'p.png', width='wide')": (
        "width is 'wide'; it must be a whole number, 1 or more, and 4096 at most"
    ),
}


def test_arguments_of_another_kind_are_refused_with_one_sentence():
    calls = "\n".join(f"try:\n    {call}\nexcept m.MmpError as error:\n    print(error)" for call in SENTENCES)
    run = subprocess.run([sys.executable, "-c", f"{BEGIN}\n{calls}"], capture_output=True, text=True, check=False)
    assert run.stdout.splitlines() == list(SENTENCES.values()), run.stderr
