"""Scripts beside the console script: misuse is one sentence and exit 2 there too."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from mmp_cli.output import complain
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.registration import CELLS


def run_script(main: Callable[[], int | None]) -> NoReturn:
    """Runs `main`, and ends the process with the code that it returns, or with 2 where it raises `MmpError`."""
    try:
        sys.exit(main())
    except MmpError as error:
        complain(error, program=Path(sys.argv[0]).name)
        sys.exit(2)


def environment_id(text: str) -> str:
    """An environment id, as an argument."""
    if text not in CELLS:
        raise argparse.ArgumentTypeError(str(UnknownNameError("environment id", text, CELLS)))
    return text
