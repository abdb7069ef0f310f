"""The content of a report, before it becomes Markdown, a page and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from mmp_cli.benchmark.known_units import KnownUnits
from mmp_cli.reporting.cactus_figure import cactus_figure, published_figure
from mmp_cli.reporting.comparison import compare, comparison_tables
from mmp_cli.reporting.figure_style import PlotStyle, RenderedFigure, plot_styles, slug
from mmp_cli.reporting.instance_choice import RULE
from mmp_cli.reporting.pairs_figure import pairs_figure
from mmp_cli.reporting.pictures import ReportPicture, render_pictures
from mmp_cli.reporting.published import Published, match
from mmp_cli.reporting.results import Results, read_results
from mmp_cli.reporting.sections import Section, sections
from mmp_cli.reporting.settings import (
    Missing,
    Settings,
    bench_command,
    missing,
    option_text,
    read_settings,
    report_command,
)
from mmp_cli.reporting.success_figure import success_figure
from mmp_cli.reporting.tables import Table, error_table, overview, section_tables
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.margins import DEFAULT_MARGIN_M, KIND_WORDS, asked_margins
from mmp_env.wording import counted

_USUAL_REFERENCE = "apf-ecbs"
_MOST_SHOWN = 100
"""Largest number of cells, and of planners, in a report."""


@dataclass(frozen=True, kw_only=True)
class ReportRequest:
    """Arguments of a report. The others are compared with `reference`; default: `apf-ecbs`, or the last planner."""

    folder: Path
    against: Sequence[str] = ()
    note: str | None = None
    title: str | None = None
    reference: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class CellReport:
    """The part of a report about one cell."""

    name: str
    tables: tuple[Table, ...]
    drawings: tuple[RenderedFigure, ...]
    pictures: tuple[ReportPicture, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """A report. `facts` say how the results were made, `commands` how to make them again."""

    title: str
    warnings: tuple[str, ...]
    facts: tuple[str, ...]
    overview: Table
    errors: Table | None
    success: RenderedFigure
    parts: tuple[CellReport, ...]
    planners: Table | None
    commands: tuple[str, ...]
    names: tuple[str, ...]
    """Parts' names in the names of files."""
    drawings: tuple[RenderedFigure, ...] = field(default=())
    rule: str = RULE

    @property
    def pictures(self) -> tuple[ReportPicture, ...]:
        """Returns the pictures of all parts."""
        return tuple(picture for part in self.parts for picture in part.pictures)


def make_report(request: ReportRequest, published: Sequence[Published]) -> Report:
    """Reads the folder and returns the report. Raises `MmpError`. It writes nothing."""
    results, settings = read_results(request.folder), read_settings(request.folder)
    held = sections(results.lines, [x.label for x in settings.planners] if settings else ())
    labels = list(dict.fromkeys(run.label for section in held for run in section.runs))
    for what, count in (("cells", len(held)), ("planners", len(labels))):
        if count > _MOST_SHOWN:
            raise MmpError(f"{request.folder} has results of {count} {what}; a report shows at most {_MOST_SHOWN}")
    reference = _reference(request.reference, labels)
    styles = plot_styles(labels)
    matches = [(x, match(x, held)) for x in published]
    taken = {"success"}
    names = [slug(section.name, taken) for section in held]
    pictures_of = render_pictures(held, names, settings, request.folder)
    parts = tuple(
        _part(section, matches, styles, reference, settings, name, pictures_of.pictures.get(section.name, ()))
        for section, name in zip(held, names, strict=True)
    )
    success = success_figure(held, styles)
    lacking = missing(settings, results.lines, request.folder) if settings else Missing()
    commands = [bench_command(settings, request.folder)] if settings else []
    return Report(
        title=request.title or f"Benchmark: {', '.join(section.name for section in held)}",
        warnings=tuple(_warnings(results, held, lacking, settings)),
        facts=(*_facts(results, settings), *pictures_of.lacking),
        overview=overview(held),
        errors=error_table(held),
        success=success,
        parts=parts,
        planners=_planner_table(settings) if settings else None,
        commands=(
            *commands,
            report_command(request.folder, request.against, request.note, request.title, request.reference),
        ),
        names=tuple(names),
        drawings=(success, *(drawing for part in parts for drawing in part.drawings)),
    )


def _reference(asked: str | None, labels: Sequence[str]) -> str:
    if asked is None:
        return _USUAL_REFERENCE if _USUAL_REFERENCE in labels else labels[-1]
    if asked not in labels:
        raise UnknownNameError("planner in these results", asked, labels)
    return asked


def _part(
    section: Section,
    matches: Sequence[tuple[Published, dict[str, dict[str, Any]]]],
    styles: dict[str, PlotStyle],
    reference: str,
    settings: Settings | None,
    name: str,
    pictures: tuple[ReportPicture, ...],
) -> CellReport:
    limit_s = settings.time_limit_s if settings else None
    drawings = [
        cactus_figure(section, styles, f"cactus-{name}", limit_s),
        pairs_figure(section, reference, styles, f"pairs-{name}"),
    ]
    tables = section_tables(section)
    for k, (published, rows) in enumerate(matches, 1):
        if section.name in rows:
            comparison = compare(published, section, rows)
            tables += comparison_tables(comparison)
            count = f"-{k}" if len(matches) > 1 else ""
            drawings.append(published_figure(comparison, styles, f"published-{name}{count}"))
    return CellReport(
        name=section.name, tables=tuple(tables), drawings=tuple(x for x in drawings if x), pictures=pictures
    )


def _warnings(results: Results, held: Sequence[Section], lacking: Missing, settings: Settings | None) -> list[str]:
    out = []
    if settings and (number := _first_stray(results, KnownUnits(settings))) is not None:
        out.append(f"Line {number} of the results is not a result of this benchmark; it counts all the same.")
    runs = [run for section in held for run in section.runs]
    if count := sum(len(run.errors) for run in runs):
        out.append(f"{counted(count, 'unit')} ended in an ERROR; they count as not solved and are listed below.")
    if lacking.units:
        by = ", ".join(f"{label} {count}" for label, count in lacking.by_planner.items())
        out.append(f"The run is not finished: {lacking.units} of {lacking.expected} units are missing ({by}).")
    if lacking.unknown:
        out.append(f"Whether anything is missing of {', '.join(lacking.unknown)} is not known: it cannot be read here.")
    if results.torn:
        out.append("The last line of the results was cut off and is left out; `mmp bench` repairs it when it goes on.")
    if results.repeated:
        out.append(
            f"{counted(results.repeated, 'line')} left out: the unit stands before, and the first of each counts."
        )
    return out


def _first_stray(results: Results, units: KnownUnits) -> int | None:
    """Returns the number of the first line that is of no unit of the settings, or None."""
    rows = zip(results.numbers, results.lines, strict=True)
    return next((number for number, line in rows if not units.has((line.instance, line.planner, line.seed))), None)


def _facts(results: Results, settings: Settings | None) -> list[str]:
    machines = dict.fromkeys(line.machine for line in results.lines if line.machine)
    versions = dict.fromkeys(line.version for line in results.lines if line.version)
    out = [f"Machine: {'; '.join(machines) or 'not stated'}.", f"mmp-env: {', '.join(versions) or 'not stated'}."]
    if settings is None:
        return [*out, "There is no settings.json: limits and options are not known."]
    limit = "no time limit" if settings.time_limit_s is None else f"{settings.time_limit_s:g} s"
    drawn = f"first seed {settings.seed}"
    asked = [f"{m * 1e3:g} mm {KIND_WORDS[kind]}" for kind, m in asked_margins(settings.margin).items()]
    default = f"none, so {DEFAULT_MARGIN_M * 1e3:g} mm or less at a tight start or goal"
    margin = ", ".join(asked) or default
    out.append(f"Time limit: {limit} per instance, one core each; {drawn}; margin asked: {margin}.")
    out.append(f"Robot: {settings.robot or 'as the source says'}; task: {settings.task or 'as the source says'}.")
    out.append(_company(results))
    return out


def _company(results: Results) -> str:
    """Returns the sentence on what ran beside each run: other runs of the benchmark, and other processes."""
    workers = sorted({int(line.workers) for line in results.lines if line.workers is not None})
    loads = [line.load for line in results.lines if line.load is not None]
    at_once = " or ".join(map(str, workers)) or "not noted"
    load = f"{median(loads):.1f}, at most {max(loads):.1f}" if loads else "not noted"
    return f"Runs at a time: {at_once}; load of the machine, median: {load}."


def _planner_table(settings: Settings) -> Table:
    rows = []
    for x in settings.planners:
        options = ", ".join(f"{key}={option_text(value)}" for key, value in x.options.items())
        rows.append([x.label, x.name, options or "the defaults"])
    return Table(title="Planners", head=["label", "planner", "options"], rows=rows, text=True)
