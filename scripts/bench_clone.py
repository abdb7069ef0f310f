"""Runs the notebook that clones an expert, and prints how many new goals the clone reaches: a JSON line."""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from typing import Any

from figure import ROOT, print_figure

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script

NOTEBOOK = ROOT / "docs" / "tutorials" / "clone_an_expert.ipynb"


def main() -> None:
    """Prints the goals that the clone, the straight line and the expert reach."""
    Parser("bench_clone.py", __doc__, argparse.RawDescriptionHelpFormatter).parse()
    names: dict[str, Any] = {"__name__": "__main__"}
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for cell in cells:
            if cell["cell_type"] == "code":
                exec("".join(cell["source"]), names)
        os.chdir(ROOT)
    reached = {name: found.count("success") for name, found in names["outcomes"].items()}
    print_figure(
        "clone_reached",
        reached["clone"],
        f"of {names['TRIALS']} goals",
        line=reached["line"],
        contacts=names["outcomes"]["clone"].count("contact"),
        expert=len(names["episodes"]),
        episodes=names["EPISODES"],
    )


if __name__ == "__main__":
    run_script(main)
