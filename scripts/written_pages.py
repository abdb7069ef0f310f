"""Writes pages, whole or between marks, or reports that they are out of date."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NoReturn

from mmp_cli.arguments import Parser

_PLACE = re.compile(r"(<!-- table: (\S+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def filled(page: str, table: Callable[[str], str]) -> str:
    """Returns the page with `table(NAME)` between each `<!-- table: NAME -->` and the next `<!-- end of table -->`."""
    return _PLACE.sub(lambda place: place[1] + table(place[2]) + place[3], page)


def checking_parser(prog: str, description: str | None) -> Parser:
    """Returns the argument parser of a script that writes pages."""
    out = Parser(prog, description, argparse.RawDescriptionHelpFormatter)
    out.add_argument("--check", action="store_true", help="write nothing; exit 1 if a page is out of date")
    return out


def bring_up_to_date(pages: Mapping[Path, str], *, check: bool) -> NoReturn:
    """Writes the pages that differ from their text here, and ends the program.

    With `check` it writes nothing, and the exit code is 1 if a page is out of date.
    """
    stale = [path for path, text in pages.items() if not path.exists() or path.read_text(encoding="utf-8") != text]
    if not check:
        for path in stale:
            path.write_text(pages[path], encoding="utf-8")
    names = ", ".join(path.name for path in stale)
    print(f"{names} {'out of date' if check else 'written'}" if stale else "up to date")
    sys.exit(1 if check and stale else 0)
