"""Legend of a drawing, with the marks that occur in it."""

from __future__ import annotations

from collections.abc import Iterator

from mmp_env.view.tree_drawing.boxes import bolt
from mmp_env.view.tree_drawing.colors import BODY, FAINT, FREE, INK, SOLUTION_PATH, UNKNOWN, conflict_color
from mmp_env.view.tree_drawing.discs import diamond
from mmp_env.view.tree_drawing.svg import element, text_width, words
from mmp_env.view.tree_record import TreeRecord

_SIZE, _ROW, _APART = 12.0, 24.0, 24.0
_SAMPLE = 18.0


def draw_legend(tree: TreeRecord, style: str, width: float) -> tuple[list[str], float]:
    """Returns the items in rows of at most `width` [px], and their height [px]."""
    out, x, y = [], 0.0, 0.0
    for sample, wide in _items(tree, style):
        if x > 0 and x + wide > width:
            x, y = 0.0, y + _ROW
        out.append(element("g", *sample, transform=f"translate({x:.1f} {y:.1f})"))
        x += wide + _APART
    return out, y + _ROW if out else 0.0


def _items(tree: TreeRecord, style: str) -> Iterator[tuple[list[str], float]]:
    """Yields each item, whose middle is at y = 12, and its width."""
    counts = {node.conflicts for node in tree.nodes}
    if style != "boxes":
        yield from _scale(counts)
    named = [(True, "expanded")] if any(node.expanded for node in tree.nodes) else []
    if named and not all(node.expanded for node in tree.nodes):
        named.append((False, "generated, not expanded"))
    for expanded, text in named:
        yield _named([_node(style, expanded)], text)
    if any(node.fast_track for node in tree.nodes):
        mark = bolt(4, 5, 14.0) if style == "boxes" else diamond(9, 12, 6.5, fill=FREE, stroke=INK, class_="mmp-line")
        yield _named([mark], "made by the fast track")
    if tree.solution is not None:
        line = element(
            "path", d="M0 12H18", stroke=SOLUTION_PATH, stroke_width=4.0, stroke_linecap="round", class_="mmp-solution"
        )
        yield _named([line], "path to the solution" if len(tree.solution_path) > 1 else "the solution")


def _scale(counts: set[int | None]) -> Iterator[tuple[list[str], float]]:
    """Yields swatches of the colours that occur, with their numbers of conflicts."""
    most = max((count or 0 for count in counts), default=0)
    steps = {count for count in counts if count == 0}
    if most > 0:
        steps |= {max(1, round(most * (k / 4) ** 2)) for k in range(5)}
    swatches = [(conflict_color(count, most), str(count)) for count in sorted(steps)]
    if None in counts:
        swatches.append((UNKNOWN, "unknown"))
    out = [words("conflicts", 0, 16, size=_SIZE, class_="mmp-faint", fill=FAINT)]
    x = text_width("conflicts", _SIZE) + 6
    for color, text in swatches:
        out.append(element("rect", x=x, y=5.0, width=14.0, height=14.0, rx=2, fill=color, stroke=INK, stroke_width=0.5))
        out.append(words(text, x + 18, 16, size=_SIZE))
        x += 18 + text_width(text, _SIZE) + 8
    yield out, x - 8


def _node(style: str, expanded: bool) -> str:
    line = {"stroke": INK, "stroke_dasharray": None if expanded or style == "dots" else "3 2.2"}
    if style == "boxes":
        return element(
            "rect", x=0, y=5, width=18, height=14, rx=3, fill=BODY, stroke_width=1.2, class_="mmp-line mmp-body", **line
        )
    radius = (5.2 if expanded else 3.6) if style == "dots" else 7.0
    thick = 1.2 if expanded or style != "dots" else 0.6
    return element("circle", cx=9, cy=12, r=radius, fill=UNKNOWN, stroke_width=thick, class_="mmp-line", **line)


def _named(sample: list[str], text: str) -> tuple[list[str], float]:
    sample.append(words(text, _SAMPLE + 6, 16, size=_SIZE))
    return sample, _SAMPLE + 6 + text_width(text, _SIZE)
