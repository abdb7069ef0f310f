"""Progress of an import of a robot or tool."""

from __future__ import annotations

from collections.abc import Callable

from mmp_cli.output import printable


class ImportProgress:
    """One line on a terminal that says which step was done last, and nothing elsewhere."""

    def __enter__(self) -> Callable[[str], None]:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        self._bar: Progress | None = None
        if not console.is_terminal:
            return lambda line: None
        columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
        self._bar = Progress(*columns, console=console, transient=True)
        task = self._bar.add_task("reading", total=None)
        self._bar.start()
        bar = self._bar
        return lambda line: bar.update(task, description=printable(line))

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.stop()
