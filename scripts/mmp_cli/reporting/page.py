"""`report.html`: one file without scripts and without anything from elsewhere, for the screen and for paper."""

from __future__ import annotations

from importlib import resources

from mmp_cli.output import one_line
from mmp_cli.reporting.report import Report

_TEMPLATE = "report.html.jinja"


def as_page(report: Report) -> str:
    """The page; all text is escaped by the template, figures are inline SVG."""
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, finalize=_visible, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    # Figures are our own SVG, in which matplotlib has turned every name into outlines.
    environment.filters["figure"] = lambda drawing: Markup(drawing.inline)
    text = resources.files("mmp_cli.reporting").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    return environment.from_string(text).render(report=report)


def _visible(value: object) -> object:
    """Text with nothing that changes the direction of what follows, or is not seen; figures as they are."""
    return one_line(value) if type(value) is str else value
