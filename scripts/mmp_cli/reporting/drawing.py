"""How the figures look, and how they become files: SVG and PNG, and SVG that lives inside the page.

Matplotlib is imported when the first figure is drawn, and without pyplot: nothing here depends on a display.
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
"""Six of Okabe and Ito's, and four that are as far from these and from each other for colour-blind readers.

Two of Okabe and Ito's are left out, because they vanish on white or on black.
"""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)))
_DPI = 160
_MOST_PIXELS = 2**15
"""Largest side of a figure; matplotlib makes none of twice as many."""
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
class Drawing:
    """A figure: `name` is that of its files, `svg` and `png` what stands in them, `inline` the SVG for the page."""

    name: str
    caption: str
    svg: str
    png: bytes
    inline: str


@dataclass(frozen=True, kw_only=True)
class Look:
    """How one planner looks in every figure of a report."""

    colour: str
    marker: str
    dashes: Any


@contextmanager
def drawn(width: float, height: float) -> Iterator[Figure]:
    """An empty figure [inch] in our style; draw within the block, and call `finished` there."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height))


def finished(figure: Figure, name: str, caption: str) -> Drawing:
    """The figure as files."""
    with warnings.catch_warnings():
        # A label may have characters that the font lacks; a box stands for them.
        warnings.filterwarnings("ignore", message="Glyph .* missing from", category=UserWarning)
        # The layout takes longer than all the rest, and is the same for both.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        svg, png = io.StringIO(), io.BytesIO()
        dpi = min(_DPI, _MOST_PIXELS / max(figure.get_size_inches()))
        figure.savefig(svg, format="svg", dpi=dpi, metadata={"Date": None}, facecolor="none")
        figure.savefig(png, format="png", dpi=dpi, metadata={"Software": None}, facecolor="white")
    text = svg.getvalue()
    return Drawing(name=name, caption=caption, svg=_on_white(text), png=png.getvalue(), inline=_inline(text, name))


def looks(labels: Sequence[str]) -> dict[str, Look]:
    """A look for each label, by its place; no two are the same in all of colour, marker and dashes."""
    n, m, d = len(COLOURS), len(MARKERS), len(DASHES)
    return {
        label: Look(colour=COLOURS[k % n], marker=MARKERS[(k + k // n) % m], dashes=DASHES[(k + k // n) % d])
        for k, label in enumerate(labels)
    }


def words(text: str) -> str:
    """A name as matplotlib prints it as it is: no formulas, no line breaks, not hidden from a legend, not too long."""
    shown = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    shown = shown if len(shown) <= _LONGEST_NAME else shown[: _LONGEST_NAME - 1] + "…"
    return (f" {shown}" if shown.startswith("_") else shown).replace("$", r"\$")


def logarithmic(axes: Axes, *, which: str, from_zero: bool = False) -> None:
    """A logarithmic axis `x` or `y` with plain labels; `from_zero`: linear up to 1, so that a count of 0 is there."""
    from matplotlib.ticker import FuncFormatter, NullLocator

    scale: dict[str, Any] = {"value": "symlog", "linthresh": 1.0} if from_zero else {"value": "log"}
    for letter in which:
        getattr(axes, f"set_{letter}scale")(**scale)
        axis = getattr(axes, f"{letter}axis")
        axis.set_major_formatter(FuncFormatter(lambda value, _: _tick(float(value))))
        axis.set_minor_locator(NullLocator())


def width_of(names: Iterable[str]) -> float:
    """How much room the longest of the names takes as a label [inch], more or less."""
    return 0.085 * max((len(words(name)) for name in names), default=0)


def counts(most: float) -> list[int]:
    """Ticks of an axis of counts from zero: powers of ten, every second one where there are many."""
    last = math.ceil(math.log10(max(most, 10)))
    return [0, *(10**k for k in range(0, last + 1, 1 if last <= 4 else 2))]


def decades(low: float, high: float) -> tuple[float, float]:
    """Limits of a logarithmic axis around two values, far enough apart to have two numbers on it."""
    low = max(low, 1e-6)
    begin = 10.0 ** math.floor(math.log10(low) - 0.05)
    return begin, max(high * 1.3, begin * 12)


def slug(name: str, taken: set[str]) -> str:
    """A file name made of `name`, different from those taken, to which it is added."""
    plain = re.sub(r"[^A-Za-z0-9.-]+", "-", name).strip("-.")[:60] or "cell"
    out, k = plain, 2
    while out.lower() in taken:
        out, k = f"{plain}-{k}", k + 1
    taken.add(out.lower())
    return out


def _tick(value: float) -> str:
    """A number on an axis, short."""
    for unit, letter in ((1e6, "M"), (1e3, "k")):
        if value >= unit:
            return f"{value / unit:g}{letter}"
    return f"{value:g}"


def _on_white(svg: str) -> str:
    """The SVG with a background: a file may be shown on black."""
    head, tag, rest = svg.partition("<svg")
    opening, end, content = rest.partition(">")
    return f'{head}{tag}{opening}{end}\n <rect width="100%" height="100%" fill="white"/>{content}'


def _inline(svg: str, name: str) -> str:
    """The SVG without what only a file needs; its ink follows the page's, light or dark, and ids are its own."""
    svg = svg[svg.index("<svg") :].replace(INK, "currentColor")
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    return re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", svg).strip()
