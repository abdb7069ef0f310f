"""`report.html`: one file without scripts and external parts, for the screen and for paper."""

from __future__ import annotations

from importlib import resources

from mmp_cli.output import one_line
from mmp_cli.reporting.report import Report

_TEMPLATE = "report.html.jinja"


def as_page(report: Report) -> str:
    """Returns the page. The template escapes all text; figures are inline SVG."""
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, finalize=_visible, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    # Figures are our own SVG, in which names are outlines.
    environment.filters["figure"] = lambda drawing: Markup(drawing.inline)
    text = resources.files("mmp_cli.reporting").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    return environment.from_string(text).render(report=report)


def _visible(value: object) -> object:
    """Returns text without invisible characters and without those that change its direction."""
    return one_line(value) if type(value) is str else value
