"""Plants faults in a copy of a robot folder and lets the contract test look for them.

Usage: attack_robot_check.py ROBOT [--faults N] [--seed N]. Fingerprints are computed again after each fault, so hashes
find nothing. Each fault is really wrong: a sphere counts only if a surface point lies outside all spheres afterwards.
It prints a JSON line for each kind of fault; exit 1 if a fault was not found.
"""

from __future__ import annotations

import argparse
import copy
import json
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from planted_faults import FAULTS, Files

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import MmpError
from mmp_env.importing.fingerprint import KEY, fingerprints
from mmp_env.importing.robot_check import check_robot
from mmp_env.robot_folders import find_robot


def main() -> int:
    """Prints how many faults of each kind were planted and found."""
    parser = Parser("attack_robot_check.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", metavar="ROBOT", help="name or folder of a robot")
    parser.add_argument("--faults", type=int, default=200, metavar="N", help="planted faults (default: 200)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random choices (default: 0)")
    args = parser.parse()
    folder = find_robot(args.robot) or Path(args.robot)
    if faults := check_robot(folder).faults:
        raise MmpError(f"{folder} has faults already: {faults[0]}")
    planted, missed = attack(folder, args.faults, args.seed)
    for kind in planted:
        print(json.dumps({"fault": kind, "planted": planted[kind], "missed": missed[kind]}), flush=True)
    return 1 if missed.total() else 0


def attack(folder: Path, count: int, seed: int) -> tuple[Counter[str], Counter[str]]:
    """Returns how many faults of each kind were planted in copies of a folder, and how many the test missed."""
    random, kinds = np.random.default_rng(seed), list(FAULTS)
    planted, missed, start = Counter[str](), Counter[str](), read(folder)
    for number in range(count):
        kind = kinds[number % len(kinds)]
        files = copy.deepcopy(start)
        if not FAULTS[kind](files, random):
            continue
        planted[kind] += 1
        with tempfile.TemporaryDirectory() as work:
            copied = Path(work) / folder.name
            write(files, copied)
            missed[kind] += not check_robot(copied).faults
    return planted, missed


def read(folder: Path) -> Files:
    """Returns the contents of a folder."""
    out = {key: json.loads((folder / f"{key}.json").read_text()) for key in ("robot", "spheres", "hulls")}
    origin = {"hulls_origin": out["hulls"].pop("origin")} if "origin" in out["hulls"] else {}
    return out | origin | {"mjcf": (folder / f"{folder.name}.xml").read_text()}


def write(files: Files, folder: Path) -> None:
    """Writes the contents of a folder, with fingerprints that fit."""
    origin = {"origin": files["hulls_origin"]} if "hulls_origin" in files else {}
    texts = {"spheres.json": json.dumps(files["spheres"]), "hulls.json": json.dumps(origin | files["hulls"])}
    texts[f"{folder.name}.xml"] = files["mjcf"]
    if KEY in files["robot"]:
        files["robot"][KEY] = fingerprints(files["robot"], texts)
    folder.mkdir()
    for name, text in {**texts, "robot.json": json.dumps(files["robot"])}.items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    run_script(main)
