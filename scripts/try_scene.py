"""Plans and plays in two-arm scenes of robosuite: two Pandas at a table, and Baxter. Usage: try_scene.py [FOLDER]

FOLDER holds robosuite-1.5.2-py3-none-any.whl; without it pip downloads the wheel (157 MB). This is no test: tests
download nothing.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mmp_env
import mmp_planners
from mmp_cli.arguments import Parser
from mmp_cli.main import run_script

WHEEL = "robosuite-1.5.2-py3-none-any.whl"
ASSETS = Path("robosuite/models/assets")
PANDA_STARTS = {"left": (0.3, 0.4, 0.0, -2.0, 0.0, 2.4, 0.8), "right": (0.3, 0.4, 0.0, -2.0, 0.0, 2.4, 0.8)}
PANDA_GOALS = {"left": (-0.5, 0.6, 0.1, -1.7, 0.1, 2.3, 0.6), "right": (-0.5, 0.6, -0.2, -1.7, 0.0, 2.3, 0.9)}
BAXTER_STARTS = {"left": (0.5, 0.0, 0.6, 0.6, -1.2, 0.8, 0.1), "right": (-1.0, -0.4, 0.5, 1.6, 0.6, -0.7, -1.2)}
BAXTER_GOALS = {"left": (1.0, -0.4, -0.5, 1.6, -0.6, -0.7, 1.2), "right": (-0.5, 0.0, -0.6, 0.6, 1.2, 0.8, -0.1)}


def main() -> int:
    """Tries both scenes, and returns 0 if all goals were reached without contact."""
    parser = Parser("try_scene.py", __doc__)
    parser.add_argument("folder", metavar="FOLDER", nargs="?", help=f"folder that holds {WHEEL}; default: download it")
    args = parser.parse()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(args.folder) if args.folder else _downloaded(Path(temporary))
        zipfile.ZipFile(folder / WHEEL).extractall(temporary)
        assets = Path(temporary) / ASSETS
        prefixes = {"left": "robot0_joint", "right": "robot1_joint"}
        good = [
            _tried("two Pandas", _two_pandas(assets), prefixes, PANDA_STARTS, PANDA_GOALS),
            _tried(
                "Baxter",
                _baxter(assets),
                {"left": "baxter_left_", "right": "baxter_right_"},
                BAXTER_STARTS,
                BAXTER_GOALS,
            ),
        ]
    return 0 if all(good) else 1


def _tried(title: str, model: Any, arms: Mapping[str, str], start: Mapping[str, Any], goal: Mapping[str, Any]) -> bool:
    data = mujoco.MjData(model)
    cell = mmp_env.cell_from_mujoco(model, arms)
    assert cell.joints is not None
    data.qpos[:] = cell.joints.with_arms({name: np.array(q) for name, q in start.items()})
    problem = mmp_env.make_problem(cell, start=data.qpos, goal=goal)
    plan = mmp_planners.make("auto").plan(problem, seed=0, time_limit=20).plan
    if plan is None:
        print(f"{title}: no plan")
        return False
    check, report = mmp_env.check_plan(plan), mmp_env.play(plan, model, data)
    print(f"{title}: {cell}\n  plan {'valid' if check.valid else check}\n  {report}")
    return bool(check.valid and report.reached and not report.contacts)


def _two_pandas(assets: Path) -> Any:
    """Returns two Pandas with grippers on mounts at opposite sides of a table, with two free cubes on it."""
    arena = _spec(assets / "arenas" / "table_arena.xml")
    for number, (x, turn) in enumerate(((-0.75, 0.0), (0.75, np.pi))):
        quaternion = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
        frame = arena.worldbody.add_frame(pos=[x, 0, 0.912], quat=quaternion)
        mount = _spec(assets / "bases" / "rethink_mount.xml")
        mount.body("base").pos = [0, 0, 0]  # robosuite does the same
        arena.attach(mount, frame=frame, prefix=f"mount{number}_")
        arena.attach(_spec(assets / "robots" / "panda" / "robot.xml"), frame=frame, prefix=f"robot{number}_")
        hand = arena.body(f"robot{number}_right_hand").add_frame()
        arena.attach(_spec(assets / "grippers" / "panda_gripper.xml"), frame=hand, prefix=f"gripper{number}_")
    for k, y in enumerate((-0.15, 0.15)):
        cube = arena.worldbody.add_body(name=f"cube{k}", pos=[0, y, 0.82])
        cube.add_freejoint()
        cube.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.02, 0.02, 0.02])
    return arena.compile()


def _baxter(assets: Path) -> Any:
    """Returns Baxter on its pedestal in front of a table."""
    arena = _spec(assets / "arenas" / "table_arena.xml")
    frame = arena.worldbody.add_frame(pos=[-0.85, 0, 0.92])
    arena.attach(_spec(assets / "robots" / "baxter" / "robot.xml"), frame=frame, prefix="baxter_")
    return arena.compile()


def _spec(file: Path) -> Any:
    """Returns a spec whose meshes and textures have absolute paths, so that it can be attached."""
    spec = mujoco.MjSpec.from_file(str(file))
    for asset in (*spec.meshes, *spec.textures):
        if asset.file:
            asset.file = str((file.parent / asset.file).resolve())
    return spec


def _downloaded(folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "robosuite==1.5.2", "-d", str(folder)]
    subprocess.run(command, check=True)
    return folder


if __name__ == "__main__":
    run_script(main)
