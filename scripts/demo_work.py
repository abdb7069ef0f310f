"""Four arms take objects from two feeders and put them into boxes: planned, checked, executed, and in rounds.

The schedule is compared with the same jobs in rounds, in which all arms begin a step together.
"""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import Any

ARM_X_M, ARM_Y_M = 0.45, 0.5
FEEDER_X_M = 0.42
ROW_M = 0.13
SIZE = (0.05, 0.05, 0.08)
BIN = (0.95, 0.5)
GAP_M, AWAY_M = 0.002, 0.1
WALL_M = 0.02
DOWN = {"line": [0, 0, -AWAY_M]}
UP = {"line": [0, 0, AWAY_M]}


def above(x: float, y: float) -> dict[str, Any]:
    position = [x, y, SIZE[2] + GAP_M + AWAY_M]
    return {"move": {"pose": {"position": position, "quaternion": [0, 1, 0, 0], "free": "z"}}}


def cell() -> dict[str, Any]:
    arms, obstacles = [], [{"name": "table", "shape": "box", "position": [0, 0, -0.05], "size": [3.0, 2.0, 0.1]}]
    for k, (sx, sy) in enumerate(product((-1, 1), (-1, 1))):
        arms.append(
            {"name": f"arm{k}", "robot": "ur5e", "position": [sx * ARM_X_M, sy * ARM_Y_M, 0.0], "yaw": -sy * 1.571}
        )
        cx, cy = sx * BIN[0], sy * BIN[1]
        w, d, h = 0.34, 0.5, 0.04
        for n, (x, y, a, b) in enumerate(
            ((w / 2, 0, WALL_M, d), (-w / 2, 0, WALL_M, d), (0, d / 2, w, WALL_M), (0, -d / 2, w, WALL_M))
        ):
            obstacles.append(
                {"name": f"box{k}-wall{n}", "shape": "box", "position": [cx + x, cy + y, h / 2], "size": [a, b, h]}
            )
    return {"arms": arms, "obstacles": obstacles, "spheres": "28"}


def jobs() -> dict[str, Any]:
    objects, todo = [], []
    for n in range(24):
        feeder, k = n % 2, n // 2
        side = (-1, 1)[feeder]
        column, row = divmod(k, 2)
        x, y = side * (FEEDER_X_M + ROW_M * (column - 2.5)), (-1, 1)[row] * 0.1
        name = f"part{n}"
        objects.append(
            {"name": name, "shape": "box", "size": list(SIZE), "pose": {"position": [round(x, 3), y, SIZE[2] / 2]}}
        )
        bin_y = (-1, 1)[row]
        slot = column
        bx = side * BIN[0] + (-1, 1)[slot % 2] * 0.075
        by = bin_y * BIN[1] + (slot // 2 - 1) * 0.14
        todo.append(
            {
                "name": f"job{n}",
                "steps": [above(x, y), DOWN, {"grasp": name}, UP, above(bx, by), DOWN, {"release": name}, UP],
            }
        )
    return {"schema": "mmp-jobs/1", "name": "demo-work", "cell": cell(), "objects": objects, "jobs": todo}


if __name__ == "__main__":
    Path("/tmp/w/jobs.json").write_text(json.dumps(jobs()))
