"""Colours of a drawing: yellow to brown for conflicts, blue for none; colour-blind readers can distinguish them.

The panel, the text and the edges follow the reader's light or dark colour scheme; the nodes do not.
"""

from __future__ import annotations

import math
from itertools import pairwise

FREE = "#56b4e9"
UNKNOWN = "#c4c9cf"
SOLUTION_PATH = "#0072b2"
INK, FAINT, EDGE, PANEL, BODY, FRAME = "#1f2429", "#5d6670", "#7d8690", "#ffffff", "#ffffff", "#d5dae0"
BOLT = "#b87500"
_SCALE = ((0.0, (250, 224, 130)), (0.4, (236, 150, 60)), (0.75, (178, 62, 38)), (1.0, (92, 24, 32)))

STYLE = """
@media screen{.mmp-tree{max-width:100%;height:auto}}
@media (prefers-color-scheme:dark){
.mmp-panel{fill:#15181c;stroke:#343b43}.mmp-body{fill:#23282e}
.mmp-ink{fill:#eceff2}.mmp-faint{fill:#a9b2bc}.mmp-word{fill:#a9b2bc}
.mmp-edge{stroke:#6b7580}.mmp-line{stroke:#c3cad1}.mmp-solution{stroke:#4aa8e8}.mmp-solution-text{fill:#7cc4f2}
}
"""
"""Style sheet with the dark colours; without style sheets the drawing is light."""


def conflict_color(conflicts: int | None, most: int) -> str:
    """Returns the colour of a node by the square root of its conflicts, so that small numbers differ too."""
    if conflicts is None:
        return UNKNOWN
    if conflicts <= 0:
        return FREE
    share = math.sqrt(min(conflicts, most) / most) if most > 1 else 0.0
    for (low, first), (high, last) in pairwise(_SCALE):
        if share <= high:
            mix = (share - low) / (high - low)
            return "#" + "".join(f"{round(a + mix * (b - a)):02x}" for a, b in zip(first, last, strict=True))
    return "#" + "".join(f"{part:02x}" for part in _SCALE[-1][1])


def text_color(background: str) -> str:
    """Returns black or white, whichever has more contrast with the background."""
    light = luminance(background)
    return "#ffffff" if 1.05 / (light + 0.05) > (light + 0.05) / 0.05 else "#000000"


def contrast(one: str, other: str) -> float:
    """Returns the contrast ratio of two colours `#rrggbb` as WCAG 2 defines it, 1 to 21."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def luminance(color: str) -> float:
    """Returns the relative luminance of `#rrggbb` as WCAG 2 defines it, 0 to 1."""
    parts = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
