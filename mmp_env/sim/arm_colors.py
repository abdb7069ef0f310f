"""Colours of the arms, the same in pictures, films and recordings."""

from __future__ import annotations

import colorsys

PALETTE = (
    (0.00, 0.45, 0.70),
    (0.90, 0.62, 0.00),
    (0.00, 0.62, 0.45),
    (0.80, 0.47, 0.65),
    (0.34, 0.71, 0.91),
    (0.84, 0.37, 0.00),
    (0.94, 0.89, 0.26),
    (0.38, 0.38, 0.38),
)
"""Colours that colour-blind people can distinguish, in an order with large differences between neighbours.

After M. Okabe and K. Ito, "Color Universal Design", with dark grey for their black.
"""
_LIGHTNESS = (1.0, 0.55, 1.4)
"""Factors of the lightness: the palette repeats darker, then lighter."""


def arm_color(number: int) -> tuple[float, float, float]:
    """Returns red, green, blue in 0..1 of the arm of that number. The palette repeats after eight arms."""
    color = PALETTE[number % len(PALETTE)]
    factor = _LIGHTNESS[number // len(PALETTE) % len(_LIGHTNESS)]
    if factor == 1.0:
        return color
    hue, lightness, saturation = colorsys.rgb_to_hls(*color)
    return colorsys.hls_to_rgb(hue, min(lightness * factor, 0.9), saturation)
