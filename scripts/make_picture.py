"""Makes the picture of the README: eight arms on their way, their goals as ghosts. Usage: make_picture.py [FILE]

It plans MultiArmCell-8, seed 7, with apf-ecbs, and takes a minute or two without a graphics card.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from animated_png import animated_png

import mmp_planners
from mmp_env import MmpError, draw_instance, make_problem, ring_cell
from mmp_env.rendering import Camera
from mmp_env.simulation import Simulation
from mmp_env.writing import check_writable

ARMS, SEED = 8, 7
WIDTH, HEIGHT, COLORS = 560, 420, 100
FRAME_S, LAST_S = 0.25, 1.5
FILE = Path(__file__).parent.parent / "docs" / "images" / "multi-arm-cell-8.png"


def main() -> None:
    """Plans, takes the pictures and writes the file."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    check_writable(path)
    cell = ring_cell(ARMS)
    problem = make_problem(cell, *draw_instance(cell, seed=SEED))
    plan = mmp_planners.make("apf-ecbs").plan(problem, seed=SEED, time_limit=60.0).plan
    if plan is None:
        raise MmpError("no plan was found in a minute")
    simulation = Simulation(cell)
    camera = Camera(simulation, WIDTH, HEIGHT, fine=True)
    goals = simulation.joined(problem.goal)
    frames = []
    for time_s in np.append(np.arange(0.0, plan.makespan_s, FRAME_S), plan.makespan_s):
        simulation.place(simulation.joined(plan.at(time_s)))
        frames.append(camera.show(goals))
    camera.close()
    durations = [round(FRAME_S * 1e3)] * (len(frames) - 1) + [round(LAST_S * 1e3)]
    path.write_bytes(animated_png(np.stack(frames), durations, COLORS))
    print(f"{path}: {len(frames)} pictures of {WIDTH} x {HEIGHT}, {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    try:
        main()
    except MmpError as error:
        sys.exit(f"make_picture.py: {error}")
