"""Contrast of tree drawings with their background, in the light and the dark colour scheme."""

import re

from mmp_env.view.tree_drawing.colors import BODY, BOLT, EDGE, FAINT, INK, PANEL, SOLUTION_PATH, STYLE, contrast

_DARK = dict(re.findall(r"[.]mmp-([a-z-]+)[{](?:fill|stroke):(#[0-9a-f]{6})", STYLE))
_SCHEMES = {
    "light": ((PANEL, BODY), (EDGE, INK, SOLUTION_PATH, BOLT), (INK, FAINT, SOLUTION_PATH)),
    "dark": (
        (_DARK["panel"], _DARK["body"]),
        (_DARK["edge"], _DARK["line"], _DARK["solution"], BOLT),
        (_DARK["ink"], _DARK["faint"], _DARK["word"], _DARK["solution-text"]),
    ),
}


def test_lines_and_texts_are_legible_in_both_colour_schemes():
    for scheme, (grounds, lines, words) in _SCHEMES.items():
        for ground in grounds:
            assert min(contrast(line, ground) for line in lines) >= 3, scheme
            assert min(contrast(word, ground) for word in words) >= 4.5, scheme
