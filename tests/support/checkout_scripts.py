"""Runs a script of the checkout, as one does from a shell."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "scripts"


def run(name: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Returns what came of it. Scripts import each other, so Python may look where they are."""
    interpreter = "bash" if name.endswith(".sh") else sys.executable
    command = [interpreter, str(SCRIPTS / name), *map(str, words)]
    env = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False)
