"""What a report says, before it becomes Markdown, a page and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mmp_cli.reporting.cactus_figure import cactus_figure, published_figure
from mmp_cli.reporting.choice import RULE
from mmp_cli.reporting.comparison import compare, comparison_tables
from mmp_cli.reporting.drawing import Drawing, Look, looks, slug
from mmp_cli.reporting.pairs_figure import pairs_figure
from mmp_cli.reporting.photographs import Photograph, take_photographs
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
"""Cells, and planners, in a report."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """What is asked for. `reference`: whom the others are paired with; by default `apf-ecbs`, or the last planner."""

    folder: Path
    against: Sequence[str] = ()
    note: str | None = None
    title: str | None = None
    reference: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """What is said of one cell."""

    name: str
    tables: tuple[Table, ...]
    drawings: tuple[Drawing, ...]
    photographs: tuple[Photograph, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """All of it. `warnings` are what must not be missed, `facts` how it was made, `commands` how to make it again."""

    title: str
    warnings: tuple[str, ...]
    facts: tuple[str, ...]
    overview: Table
    errors: Table | None
    success: Drawing
    parts: tuple[Part, ...]
    planners: Table | None
    commands: tuple[str, ...]
    names: tuple[str, ...]
    """What the files of each part are called after."""
    drawings: tuple[Drawing, ...] = field(default=())
    rule: str = RULE

    @property
    def photographs(self) -> tuple[Photograph, ...]:
        """Those of all parts."""
        return tuple(photograph for part in self.parts for photograph in part.photographs)


def make_report(wish: Wish, published: Sequence[Published]) -> Report:
    """Reads the folder and says all that there is to say. Raises `MmpError`; writes nothing."""
    results, settings = read_results(wish.folder), read_settings(wish.folder)
    held = sections(results.lines, [x.label for x in settings.planners] if settings else ())
    labels = list(dict.fromkeys(run.label for section in held for run in section.runs))
    for what, count in (("cells", len(held)), ("planners", len(labels))):
        if count > _MOST_SHOWN:
            raise MmpError(f"{wish.folder} has results of {count} {what}; a report shows at most {_MOST_SHOWN}")
    reference = _reference(wish.reference, labels)
    looked = looks(labels)
    matches = [(x, match(x, held)) for x in published]
    taken = {"success"}
    names = [slug(section.name, taken) for section in held]
    album = take_photographs(held, names, settings, wish.folder)
    parts = tuple(
        _part(section, matches, looked, reference, settings, name, album.photographs.get(section.name, ()))
        for section, name in zip(held, names, strict=True)
    )
    success = success_figure(held, looked)
    lacking = missing(settings, results.lines, wish.folder) if settings else Missing()
    commands = [bench_command(settings, wish.folder)] if settings else []
    return Report(
        title=wish.title or f"Benchmark: {', '.join(section.name for section in held)}",
        warnings=tuple(_warnings(results, held, lacking)),
        facts=(*_facts(results, settings), *album.lacking),
        overview=overview(held),
        errors=error_table(held),
        success=success,
        parts=parts,
        planners=_planner_table(settings) if settings else None,
        commands=(*commands, report_command(wish.folder, wish.against, wish.note, wish.title, wish.reference)),
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
    looked: dict[str, Look],
    reference: str,
    settings: Settings | None,
    name: str,
    photographs: tuple[Photograph, ...],
) -> Part:
    limit_s = settings.time_limit_s if settings else None
    drawings = [
        cactus_figure(section, looked, f"cactus-{name}", limit_s),
        pairs_figure(section, reference, looked, f"pairs-{name}"),
    ]
    tables = section_tables(section)
    for k, (published, rows) in enumerate(matches, 1):
        if section.name in rows:
            comparison = compare(published, section, rows)
            tables += comparison_tables(comparison)
            count = f"-{k}" if len(matches) > 1 else ""
            drawings.append(published_figure(comparison, looked, f"published-{name}{count}"))
    return Part(
        name=section.name, tables=tuple(tables), drawings=tuple(x for x in drawings if x), photographs=photographs
    )


def _warnings(results: Results, held: Sequence[Section], lacking: Missing) -> list[str]:
    out = []
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
    return out


def _planner_table(settings: Settings) -> Table:
    rows = []
    for x in settings.planners:
        options = ", ".join(f"{key}={option_text(value)}" for key, value in x.options.items())
        rows.append([x.label, x.name, options or "the defaults"])
    return Table(title="Planners", head=["label", "planner", "options"], rows=rows, text=True)
