"""Style of the figures, and their rendering: SVG and PNG files, and SVG inside the page.

Matplotlib is imported with the first figure, and without pyplot, so that no display is needed.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, FAINT = "#1f2429", "#8b929b"
COLOURS = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
    *("#8700ff", "#b41e87", "#9678ff", "#69694b"),
)
"""Six colours of Okabe and Ito, and four that colour-blind readers can distinguish from these and from each other.

Two colours of Okabe and Ito are missing, because they are illegible on white or on black.
"""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)))
_DPI = 160
_MOST_PIXELS = 2**15
"""Largest side of a figure [px]; matplotlib refuses twice as many."""
_LONGEST_NAME = 26
_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "text.color": INK,
    "axes.facecolor": "none",
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": FAINT,
    "grid.alpha": 0.25,
    "axes.axisbelow": True,
    "lines.linewidth": 1.8,
    "svg.hashsalt": "mmp",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.w_pad": 0.1,
}


@dataclass(frozen=True, kw_only=True)
class RenderedFigure:
    """A figure: name and content of its files, `svg` and `png`, and `inline`, the SVG for the page."""

    name: str
    caption: str
    svg: str
    png: bytes
    inline: str


@dataclass(frozen=True, kw_only=True)
class PlotStyle:
    """Colour, marker and dashes of one planner in every figure of a report."""

    colour: str
    marker: str
    dashes: Any


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """Yields an empty figure in our style, sizes in inch; draw and call `rendered` within the block."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height))


def rendered(figure: Figure, name: str, caption: str) -> RenderedFigure:
    """Returns the figure as files."""
    with warnings.catch_warnings():
        # The font may lack characters of a label; matplotlib draws boxes for them.
        warnings.filterwarnings("ignore", message="Glyph .* missing from", category=UserWarning)
        # The layout takes longest, and both files share it.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        svg, png = io.StringIO(), io.BytesIO()
        dpi = min(_DPI, _MOST_PIXELS / max(figure.get_size_inches()))
        figure.savefig(svg, format="svg", dpi=dpi, metadata={"Date": None}, facecolor="none")
        figure.savefig(png, format="png", dpi=dpi, metadata={"Software": None}, facecolor="white")
    text = svg.getvalue()
    return RenderedFigure(
        name=name, caption=caption, svg=_on_white(text), png=png.getvalue(), inline=_inline(text, name)
    )


def plot_styles(labels: Sequence[str]) -> dict[str, PlotStyle]:
    """Returns a style for each label by its position; no two styles agree in colour, marker and dashes."""
    n, m, d = len(COLOURS), len(MARKERS), len(DASHES)
    return {
        label: PlotStyle(colour=COLOURS[k % n], marker=MARKERS[(k + k // n) % m], dashes=DASHES[(k + k // n) % d])
        for k, label in enumerate(labels)
    }


def label_text(text: str) -> str:
    """Returns a name that matplotlib prints literally: no formula, one line, visible in legends, not too long."""
    shown = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    shown = shown if len(shown) <= _LONGEST_NAME else shown[: _LONGEST_NAME - 1] + "…"
    return (f" {shown}" if shown.startswith("_") else shown).replace("$", r"\$")


def logarithmic(axes: Axes, *, which: str, from_zero: bool = False) -> None:
    """Makes the axes `x` or `y` logarithmic with plain labels; with `from_zero` they are linear up to 1."""
    from matplotlib.ticker import FuncFormatter, NullLocator

    scale: dict[str, Any] = {"value": "symlog", "linthresh": 1.0} if from_zero else {"value": "log"}
    for letter in which:
        getattr(axes, f"set_{letter}scale")(**scale)
        axis = getattr(axes, f"{letter}axis")
        axis.set_major_formatter(FuncFormatter(lambda value, _: _tick(float(value))))
        axis.set_minor_locator(NullLocator())


def width_of(names: Iterable[str]) -> float:
    """Returns the approximate width of the longest name as a label [inch]."""
    return 0.085 * max((len(label_text(name)) for name in names), default=0)


def counts(most: float) -> list[int]:
    """Returns ticks for counts from 0: powers of ten, or every second one if there are many."""
    last = math.ceil(math.log10(max(most, 10)))
    return [0, *(10**k for k in range(0, last + 1, 1 if last <= 4 else 2))]


def decades(low: float, high: float) -> tuple[float, float]:
    """Returns limits of a logarithmic axis around two values, wide enough for two tick labels."""
    low = max(low, 1e-6)
    begin = 10.0 ** math.floor(math.log10(low) - 0.05)
    return begin, max(high * 1.3, begin * 12)


def slug(name: str, taken: set[str]) -> str:
    """Returns a file name made from `name` that is not in `taken`, and adds it there."""
    plain = re.sub(r"[^A-Za-z0-9.-]+", "-", name).strip("-.")[:60] or "cell"
    out, k = plain, 2
    while out.lower() in taken:
        out, k = f"{plain}-{k}", k + 1
    taken.add(out.lower())
    return out


def _tick(value: float) -> str:
    """Returns a short tick label."""
    for unit, letter in ((1e6, "M"), (1e3, "k")):
        if value >= unit:
            return f"{value / unit:g}{letter}"
    return f"{value:g}"


def _on_white(svg: str) -> str:
    """Returns the SVG with a white background, for viewers with a black one."""
    head, tag, rest = svg.partition("<svg")
    opening, end, content = rest.partition(">")
    return f'{head}{tag}{opening}{end}\n <rect width="100%" height="100%" fill="white"/>{content}'


def _inline(svg: str, name: str) -> str:
    """Returns the SVG for the page: without file headers, with the page's text colour, and with unique ids."""
    svg = svg[svg.index("<svg") :].replace(INK, "currentColor")
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    return re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", svg).strip()
