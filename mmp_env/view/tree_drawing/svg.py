"""Elements of an SVG drawing as text, its frame, and the width of text in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.sax.saxutils import escape

from mmp_env.view.tree_drawing.colors import FRAME, PANEL, STYLE

FONT = "Helvetica, Arial, 'DejaVu Sans', sans-serif"
_NOT_IN_XML = re.compile("[^\t\n\r\u0020-~\u00a0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_TURNING = re.compile("[\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Characters that change the direction of text."""
_NOT_IN_A_UNIT = re.compile(r"(?<!\d)\s+|\s+(?!(?:s|m|rad)\b)")
_ADVANCES = (
    "32 41 46 84 64 96 78 28 40 40 50 84 32 37 32 34 64 64 64 64 64 64 64 64 64 64 34 34 84 84 84 54 "
    "100 69 69 70 78 64 58 78 76 30 30 66 56 87 75 79 61 79 70 64 62 74 69 99 69 62 69 40 34 40 84 50 "
    "50 62 64 55 64 62 36 64 64 28 28 58 28 98 64 62 64 64 42 53 40 64 60 82 60 60 53 64 34 64 84"
)
_EMS = {chr(32 + k): int(hundredths) / 100 for k, hundredths in enumerate(_ADVANCES.split())}
"""Widths [em] of the ASCII characters in DejaVu Sans, which is wider than the fonts named before it."""
_FOREIGN, _BOLD = 1.05, 1.18


def quoted(text: str) -> str:
    """Returns text escaped for XML; characters that XML does not allow are replaced."""
    return escape(_TURNING.sub("\ufffd", _NOT_IN_XML.sub("\ufffd", text)), {'"': "&quot;"})


def element(tag: str, *content: str, **attributes: object) -> str:
    """Returns an element; `content` is XML. `class_` means `class`, `_` within a name means `-`, None is left out."""
    fields = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{quoted(_plain(value))}"'
        for name, value in attributes.items()
        if value is not None
    )
    return f"<{tag}{fields}>{''.join(content)}</{tag}>" if content else f"<{tag}{fields}/>"


def words(text: str, x: float, y: float, *, size: float, bold: bool = False, **attributes: object) -> str:
    """Returns text whose base line begins at (x, y), or is centred there with `text_anchor="middle"`."""
    attributes = {"class_": "mmp-ink", "fill": "#1f2429"} | attributes
    weight = "bold" if bold else None
    return element("text", quoted(text), x=x, y=y, font_size=size, font_weight=weight, **attributes)


def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Returns an upper bound of the width [px] of a line of text in a common sans-serif font."""
    return sum(_EMS.get(character, _FOREIGN) for character in text) * size * (_BOLD if bold else 1.0)


def cut(text: str, size: float, width: float, *, bold: bool = False) -> str:
    """Returns the text, shortened if it does not fit into `width` [px]."""
    if text_width(text, size, bold=bold) <= width:
        return text
    while text and text_width(text + "…", size, bold=bold) > width:
        text = text[:-1]
    return text.rstrip() + "…"


def wrapped(text: str, size: float, width: float, lines: int) -> list[str]:
    """Returns the text in as few lines as possible, of similar length; text too long for `lines` is shortened."""
    parts = _NOT_IN_A_UNIT.split(text.strip()) if text.strip() else []
    out = _filled(parts, size, width, lines)
    narrower = width
    while out and narrower > size:
        narrower *= 0.95
        tried = _filled(parts, size, narrower, lines)
        if len(tried) > len(out) or max(text_width(line, size) for line in tried) > narrower:
            break
        out = tried
    return [cut(line, size, width) for line in out]


def svg_page(content: Sequence[str], width: float, height: float, description: str) -> str:
    """Returns the text of an SVG file of `width` x `height` [px]; a screen reader reads the `description`."""
    panel = {"class_": "mmp-panel", "fill": PANEL, "stroke": FRAME}
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="{FONT}" class="mmp-tree" role="img">',
            element("title", quoted(description)),
            element("style", quoted(STYLE)),
            element("rect", x=0.5, y=0.5, width=width - 1, height=height - 1, rx=8, **panel),
            *content,
            "</svg>\n",
        )
    )


def _filled(parts: list[str], size: float, width: float, lines: int) -> list[str]:
    """Fills each line as far as possible; the last one may be too long."""
    out: list[str] = []
    for part in parts:
        if out and (text_width(f"{out[-1]} {part}", size) <= width or len(out) == lines):
            out[-1] += f" {part}"
        else:
            out.append(part)
    return out


def _plain(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
