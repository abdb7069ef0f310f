"""The sheet that a drawing stands on, which goes with the reader's light or dark colours."""

from __future__ import annotations

from collections.abc import Sequence

from mmp_env.view.tree_drawing.colors import FRAME, PANEL, STYLE
from mmp_env.view.tree_drawing.svg import FONT, element, quoted


def page(content: Sequence[str], width: float, height: float, description: str) -> str:
    """The text of an SVG file of `width` x `height` [px]; `content` is SVG, `description` what a screen reader says."""
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
