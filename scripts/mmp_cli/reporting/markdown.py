"""`table.md`: the tables of the report as Markdown, to paste or include elsewhere."""

from __future__ import annotations

from mmp_cli.output import one_line, printable
from mmp_cli.reporting.report import Report
from mmp_cli.reporting.tables import Table
from mmp_env.wording import markdown_escaped


def as_markdown(report: Report) -> str:
    """Returns the file."""
    parts = [f"# {escaped(report.title)}", *(escaped(x) for x in report.facts), *(f"**{escaped(x)}**" for x in
             report.warnings), table_text(report.overview, level=2)]  # fmt: skip
    if report.errors:
        parts.append(table_text(report.errors, level=2))
    for part in report.parts:
        parts += [f"## {escaped(part.name)}", *(table_text(table, level=3) for table in part.tables)]
    parts += ["## Made again by", *(f"    {printable(command)}" for command in report.commands)]
    return "\n\n".join(parts) + "\n"


def table_text(table: Table, *, level: int) -> str:
    """Returns heading, table and note; numbers are right-aligned."""
    rule = ["---" if table.text or not k else "---:" for k in range(len(table.head))]
    lines = ["| " + " | ".join(row) + " |" for row in [list(map(escaped, table.head)), rule]]
    lines += ["| " + " | ".join(map(escaped, row)) + " |" for row in table.rows]
    parts = [f"{'#' * level} {escaped(table.title)}", "\n".join(lines)]
    return "\n\n".join([*parts, escaped(table.note)] if table.note else parts)


def escaped(text: str) -> str:
    """Returns text on one line in which no character has a meaning in Markdown."""
    return markdown_escaped(one_line(text))
