"""The colours of the arms, which colour-blind people can distinguish."""

from itertools import combinations

import numpy as np
import pytest

from mmp_env.sim.arm_colors import PALETTE, arm_color

SIGHTS = {
    "usual": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
"""Colour vision -> matrix of linear red, green, blue: G. Machado, M. Oliveira, L. Fernandes 2009, severity 1."""
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def lab(color, sight):
    """Returns CIE L*a*b* of an sRGB colour as a person with that sight perceives it."""
    srgb = np.array(color)
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    xyz = XYZ @ np.clip(np.array(sight) @ linear, 0, 1) / XYZ.sum(axis=1)
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHTS.values(), ids=SIGHTS)
def test_eight_arms_have_distinct_colours_with_any_sight(sight):
    seen = [lab(arm_color(k), sight) for k in range(8)]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 15  # 2.3 is just noticeable


def test_more_arms_than_colours_have_colours_of_their_own():
    colors = [arm_color(k) for k in range(24)]
    assert colors[:8] == list(PALETTE)
    assert len(set(colors)) == 24
    assert all(0 <= part <= 1 for color in colors for part in color)
