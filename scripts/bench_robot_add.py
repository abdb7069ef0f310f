"""Time and memory of `mmp robot add` on a 7-joint arm of large meshes: JSON lines. Usage: bench_robot_add.py"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from figure import print_figure, rounded

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script

JOINTS = 7
RINGS, CORNERS = 250, 200
"""Rings of vertices of a mesh, and vertices of a ring."""
TRIANGLES = 2 * RINGS * CORNERS
LENGTHS_M = (0.28, 0.7, 0.26, 0.65, 0.22, 0.6, 0.14, 0.1)
RADII_M = (0.09, 0.04, 0.065, 0.04, 0.055, 0.035, 0.045, 0.04)
BEND_RAD = 2.6
"""Angle by which every other link is bent, so far that it is decomposed."""
FLANGE_SHARE, FLANGE_FACTOR = 0.12, 1.25
AXES = ("0 1 0", "0 0 1")
BUMPS, BUMP_SHARE = 9, 0.04
PROGRAM = "from mmp_cli.main import main; raise SystemExit(main())"


@dataclass(frozen=True, kw_only=True)
class Finished:
    """Times and peak memory of a process that ended."""

    wall_s: float
    cpu_s: float
    peak_gb: float


def main() -> None:
    """Prints the times of the first import and of the second, which the cache answers, and the peak memory of both."""
    Parser("bench_robot_add.py", __doc__).parse()
    with tempfile.TemporaryDirectory() as folder:
        source = write_arm(Path(folder))
        data = {"XDG_DATA_HOME": f"{folder}/data", "XDG_CACHE_HOME": f"{folder}/cache"}
        words = ["robot", "add", str(source), "--name", "bench"]
        first, second = measured(words, data), measured(words, data)
    print_figure("robot-add-first", first.wall_s, "s", cpu_s=rounded(first.cpu_s), triangles=TRIANGLES)
    print_figure("robot-add-cached", second.wall_s, "s", cpu_s=rounded(second.cpu_s), triangles=TRIANGLES)
    print_figure("robot-add-memory", max(first.peak_gb, second.peak_gb), "GB", triangles=TRIANGLES)


def measured(words: list[str], environment: dict[str, str]) -> Finished:
    """Runs `mmp` with its arguments on one core. Raises `CalledProcessError` if it fails."""
    command = [sys.executable, "-c", f"import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))]); {PROGRAM}"]
    begin = time.perf_counter()
    process = subprocess.Popen([*command, *words], env=os.environ | environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise subprocess.CalledProcessError(process.returncode, ["mmp", *words])
    return Finished(wall_s=wall, cpu_s=used.ru_utime + used.ru_stime, peak_gb=used.ru_maxrss * 1024 / 1e9)


def write_arm(folder: Path) -> Path:
    """Writes the URDF of the arm and its STL files. Every other link is bent."""
    links, joints = [], []
    for k in range(JOINTS + 1):
        triangles, _ = tube(LENGTHS_M[k], RADII_M[k], bent=k % 2 == 1)
        write_stl(folder / f"link{k}.stl", triangles)
        mesh = f'<geometry><mesh filename="link{k}.stl"/></geometry>'
        links.append(f'<link name="link{k}"><collision>{mesh}</collision></link>')
    for k in range(1, JOINTS + 1):
        _, end = tube(LENGTHS_M[k - 1], RADII_M[k - 1], bent=(k - 1) % 2 == 1)
        pitch = BEND_RAD if (k - 1) % 2 == 1 else 0.0
        joints.append(
            f'<joint name="joint{k}" type="revolute"><parent link="link{k - 1}"/><child link="link{k}"/>'
            f'<origin xyz="{end[0]} {end[1]} {end[2]}" rpy="0 {pitch} 0"/><axis xyz="{AXES[k % 2]}"/>'
            '<limit lower="-2.8" upper="2.8" effort="100" velocity="2"/></joint>'
        )
    path = folder / "bench.urdf"
    path.write_text(f'<robot name="bench">{"".join(links)}{"".join(joints)}</robot>', encoding="utf-8")
    return path


def tube(length: float, radius: float, *, bent: bool) -> tuple[np.ndarray, np.ndarray]:
    """Returns the triangles [t, 3, 3] [m] of a closed, bumpy tube with a flange at both ends, and its far end [3]."""
    share = np.arange(RINGS) / (RINGS - 1)
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    flange = np.where(np.minimum(share, 1 - share) < FLANGE_SHARE, FLANGE_FACTOR, 1.0)
    bumps = 1 + BUMP_SHARE * np.sin(BUMPS * np.pi * share)[:, None] * np.cos(BUMPS * angle)
    out = radius * flange[:, None] * bumps
    turn = BEND_RAD * share if bent else np.zeros(RINGS)
    arc = length / BEND_RAD
    middle = np.zeros((RINGS, 3))
    middle[:, 2] = arc * np.sin(turn) if bent else length * share
    middle[:, 0] = arc * (1 - np.cos(turn))
    across = np.stack([np.cos(turn), np.zeros(RINGS), -np.sin(turn)], axis=1)
    ring = out[..., None] * (np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * np.array([0, 1.0, 0]))
    points = middle[:, None] + ring
    after = np.roll(points, -1, axis=1)
    low, low_after, high, high_after = points[:-1], after[:-1], points[1:], after[1:]
    sides = [np.stack([low, low_after, high_after], axis=2), np.stack([low, high_after, high], axis=2)]
    caps = [
        np.stack([np.broadcast_to(middle[0], (CORNERS, 3)), after[0], points[0]], axis=1),
        np.stack([np.broadcast_to(middle[-1], (CORNERS, 3)), points[-1], after[-1]], axis=1),
    ]
    return np.concatenate([*(side.reshape(-1, 3, 3) for side in sides), *caps]), middle[-1]


def write_stl(path: Path, triangles: np.ndarray) -> None:
    """Writes a binary STL file."""
    rows = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = triangles
    path.write_bytes(bytes(80) + np.uint32(len(triangles)).tobytes() + rows.tobytes())


if __name__ == "__main__":
    run_script(main)
