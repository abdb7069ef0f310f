"""Runs a script of the checkout as from a shell."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "scripts"


def run(name: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Runs a script and returns the process. Scripts import each other, so their folder is on Python's path."""
    interpreter = "bash" if name.endswith(".sh") else sys.executable
    command = [interpreter, str(SCRIPTS / name), *map(str, words)]
    env = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False)
