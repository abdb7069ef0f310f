"""Output for people: tables on stdout, most of them of two columns, a name and what is to be said of it."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from mmp_cli.output import printable

_FILE_WIDTH = 160


def print_rows(rows: Iterable[tuple[str, str, str]]) -> None:
    """Prints rows of a name, its style and a text."""
    table = Table.grid(padding=(0, 2))
    for name, style, text in rows:
        table.add_row(Text(printable(name), style=style), Text(printable(text)))
    print_table(table)


def print_table(table: Table) -> None:
    """Prints it as wide as the terminal; in a file a line stays a line, and ends with its last word."""
    console = Console()
    if console.is_terminal:
        console.print(table)
        return
    console = Console(width=_FILE_WIDTH)
    with console.capture() as capture:
        console.print(table)
    print("\n".join(line.rstrip() for line in capture.get().splitlines()))
