"""Time of `cell_from_mujoco` on two different 7-joint arms among 30 geoms: JSON lines. Usage: bench_scene.py"""

from __future__ import annotations

import os
import tempfile
import time

import mujoco
from figure import print_figure, timed

import mmp_env
from mmp_cli.arguments import Parser
from mmp_cli.main import run_script

REPEATS = 5
GEOMS = 30
SHAPES = ('type="box" size="0.03 0.05 0.08"', 'type="sphere" size="0.05"', 'type="capsule" size="0.03 0.08"')


def main() -> None:
    """Prints the time of the first call in a process, with an empty cache, and the best of later calls."""
    Parser("bench_scene.py", __doc__).parse()
    model = mujoco.MjModel.from_xml_string(scene())
    arms = {"left": "l_", "right": "r_"}
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        begin = time.perf_counter()
        mmp_env.cell_from_mujoco(model, arms)
        print_figure("scene-first", time.perf_counter() - begin, "s")
        print_figure("scene-cached", timed(lambda: mmp_env.cell_from_mujoco(model, arms), REPEATS)[0], "s")


def scene() -> str:
    """Returns the MJCF of two arms whose links differ in length, and of geoms around them."""
    obstacles = "".join(
        f'<geom {SHAPES[k % len(SHAPES)]} pos="{0.25 * (k % 6) - 0.6} {0.8 + 0.1 * (k // 6)} {0.15 * (k // 6) + 0.1}"/>'
        for k in range(GEOMS)
    )
    return f"""<mujoco model="bench"><compiler angle="radian"/><worldbody><geom type="plane" size="0 0 1"/>{obstacles}
      {arm("l_", -0.6, 0.16)}{arm("r_", 0.6, 0.18)}</worldbody></mujoco>"""


def arm(prefix: str, x: float, length: float) -> str:
    """Returns the MJCF of an arm of 7 links, each a capsule with a box on it."""
    inner = ""
    for k in range(7, 0, -1):
        axis = "0 0 1" if k % 2 else "0 1 0"
        inner = f"""<body name="{prefix}link{k}" pos="0 0 {length + 0.03}">
          <joint name="{prefix}joint{k}" axis="{axis}" range="-2.8 2.8"/>
          <geom type="capsule" size="0.05" fromto="0 0 0 0 0 {length}"/>
          <geom type="box" size="0.04 0.06 0.05" pos="0 0.02 {length / 2}"/>{inner}</body>"""
    return f'<body name="{prefix}base" pos="{x} 0 0"><geom type="cylinder" size="0.08 0.05"/>{inner}</body>'


if __name__ == "__main__":
    run_script(main)
