"""Makes the pictures of the README and of the pages. Usage: make_gallery.py [--out FOLDER] [NAME...]

`search`: eight arms and the conflict tree that their plan comes from, an animation. `trees`: the tree of `ecbs` beside
that of `apf-ecbs`. `cells`: some of the cells. `paths`: the tool paths of each planner on one instance.
`fast-track`: two arms in conflict before a hit of the fast track, and after it.
`branches`: all branches of one tool pose. `many-arms`: a film of 48 arms.
`curves`: how the plans of `auto` get better over time, from the lines of bench_anytime.py in docs/results.
`demonstrations`: films of the five tasks of docs/reference/tasks.md on the mixed cell. `work`, `online`: films of
scripts/demo_work.sh and scripts/demo_online.sh. `imported`: robots that are not
built in; it is made only if it is named, by scripts/make_imported_picture.sh.
The instances are chosen by the rules in gallery/instances.py; the same program gives the same pictures, but for
`online`, where calls end by the clock.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from gallery.branches import save_branches
from gallery.cells import save_cells
from gallery.comparison import save_comparison
from gallery.curves import save_curves
from gallery.demonstrations import save_demonstrations
from gallery.executions import save_online, save_work
from gallery.fast_track import save_fast_track
from gallery.film import save_search
from gallery.imported import save_imported
from gallery.many_arms import save_many_arms
from gallery.tool_paths import save_tool_paths

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env.errors import UnknownNameError

FOLDER = Path(__file__).parent.parent / "docs" / "images" / "gallery"
PARTS: dict[str, Callable[[Path], None]] = {
    "search": lambda folder: save_search(folder / "search.webp"),
    "trees": lambda folder: save_comparison(folder / "trees.svg"),
    "cells": lambda folder: save_cells(folder / "cells.webp"),
    "paths": lambda folder: save_tool_paths(folder),
    "fast-track": lambda folder: save_fast_track(folder / "fast-track.webp"),
    "branches": lambda folder: save_branches(folder / "branches.webp"),
    "curves": lambda folder: save_curves(folder / "curves.svg"),
    "many-arms": lambda folder: save_many_arms(folder / "many-arms.webp"),
    "demonstrations": lambda folder: save_demonstrations(folder),
    "work": lambda folder: save_work(folder / "work.webp"),
    "online": lambda folder: save_online(folder / "online.webp"),
    "imported": lambda folder: save_imported(folder / "imported.webp"),
}
NEEDS_ROBOTS = ("imported",)
"""Parts that need robots which are not built in."""


def main() -> None:
    """Makes the parts that are named, or all."""
    parser = Parser("make_gallery.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(PARTS)}; default: all but {', '.join(NEEDS_ROBOTS)}"
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder (default: docs/images/gallery)")
    asked = parser.parse()
    if unknown := [name for name in asked.names if name not in PARTS]:
        raise UnknownNameError("part of the gallery", unknown[0], PARTS)
    asked.out.mkdir(parents=True, exist_ok=True)
    for name in asked.names or [name for name in PARTS if name not in NEEDS_ROBOTS]:
        PARTS[name](asked.out)
    files = sorted(path for path in asked.out.iterdir() if path.is_file())
    for path in files:
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    print(f"together {sum(path.stat().st_size for path in files) / 1e6:.2f} MB")


if __name__ == "__main__":
    run_script(main)
