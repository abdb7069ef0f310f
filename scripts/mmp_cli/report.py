"""`mmp report DIR`: tables and figures of a benchmark folder, as a page, as Markdown, and as SVG and PNG."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from mmp_cli.arguments import Parser


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp report", "Writes report.html, table.md and the figures of a benchmark folder into it.")
    out.add_argument("folder", metavar="DIR", help="the folder of mmp bench --out; it may still be unfinished")
    out.add_argument(
        "--against",
        action="append",
        default=[],
        metavar="FILE",
        help="published results to compare with: CSV of instance, planner, solved, planning_time_s, cost_rad; "
        "may be given several times",
    )
    out.add_argument("--against-note", metavar="TEXT", help="machine and time limit of the published results")
    out.add_argument("--title", metavar="TEXT", help="title of the page; default: the names of the cells")
    out.add_argument(
        "--reference",
        metavar="PLANNER",
        help="planner to compare the others with; default: apf-ecbs, or the last one",
    )
    return out


def run(args: Namespace) -> int:
    """Writes the report. Raises `MmpError` for bad usage and bad input, and then writes nothing."""
    from mmp_cli.output import complain, say
    from mmp_cli.reporting.folder import remove_outdated, write_files
    from mmp_cli.reporting.markdown import as_markdown
    from mmp_cli.reporting.page import as_page
    from mmp_cli.reporting.published import read_published
    from mmp_cli.reporting.report import ReportRequest, make_report
    from mmp_env.errors import MmpError
    from mmp_env.wording import counted

    if args.against_note is not None and not args.against:
        raise MmpError("--against-note describes published results; give them with --against FILE")
    request = ReportRequest(
        folder=Path(args.folder),
        against=tuple(args.against),
        note=args.against_note,
        title=args.title,
        reference=args.reference,
    )
    published = [read_published(path, request.note) for path in request.against]
    report = make_report(request, published)
    files: dict[str, str | bytes] = {}
    for drawing in report.drawings:
        files |= {f"{drawing.name}.svg": drawing.svg, f"{drawing.name}.png": drawing.png}
    files |= {f"{picture.name}.png": picture.png for picture in report.pictures}
    # The page comes last: if it is new, all other files are.
    write_files(request.folder, files | {"table.md": as_markdown(report), "report.html": as_page(report)})
    remove_outdated(request.folder, report.names, files)
    for warning in report.warnings:
        complain(warning)
    figures = counted(len(report.drawings), "figure")
    pictures = f", {counted(len(report.pictures), 'picture')}" if report.pictures else ""
    say(f"{request.folder / 'report.html'}, table.md and {figures} as SVG and PNG{pictures}")
    return 0
