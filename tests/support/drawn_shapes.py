"""Positions and sizes of texts and shapes in an SVG file, with the metrics of a real font."""

from __future__ import annotations

import functools
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextToPath

_MEASURE = TextToPath()


@dataclass(frozen=True)
class Shape:
    """A text or shape with its bounding box [px]. `node` is None if it belongs to no node."""

    kind: str
    node: int | None
    left: float
    top: float
    right: float
    bottom: float
    text: str = ""

    def overlaps(self, other: Shape, by: float = 0.0) -> bool:
        wide = min(self.right, other.right) - max(self.left, other.left)
        high = min(self.bottom, other.bottom) - max(self.top, other.top)
        return wide > by and high > by

    def holds(self, other: Shape, by: float = 0.0) -> bool:
        across = self.left - by <= other.left and other.right <= self.right + by
        return across and self.top - by <= other.top and other.bottom <= self.bottom + by


@functools.cache
def text_size(text: str, size: float, bold: bool) -> tuple[float, float]:
    """Returns width and height above the base line in DejaVu Sans, the widest font of the drawings."""
    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal", size=size)
    width, height, descent = _MEASURE.get_text_width_height_descent(text, font, ismath=False)
    # Metrics in points serve as pixels, because both scale with the size of the font.
    return width, height - descent


def read(svg: str) -> tuple[ElementTree.Element, list[Shape]]:
    """Returns the parsed drawing and its shapes, without edges and samples of the legend."""
    root = ElementTree.fromstring(svg)
    shapes: list[Shape] = []
    _walk(root, 0.0, 0.0, 1.0, None, shapes)
    return root, shapes


def named(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _walk(element, x, y, scale, node, shapes) -> None:
    moved = re.search(r"translate\(([-\d.]+) ([-\d.]+)\)", element.get("transform", ""))
    if moved:
        x, y = x + scale * float(moved[1]), y + scale * float(moved[2])
    larger = re.search(r"scale\(([\d.]+)\)", element.get("transform", ""))
    scale *= float(larger[1]) if larger else 1.0
    if element.get("data-node") is not None:
        node = int(element.get("data-node"))
    box = _box(element)
    if box is not None:
        left, top, right, bottom = (at + scale * part for at, part in zip((x, y, x, y), box, strict=True))
        shapes.append(Shape(named(element), node, left, top, right, bottom, element.text or ""))
    for child in element:
        _walk(child, x, y, scale, node, shapes)


def _box(element) -> tuple[float, float, float, float] | None:
    def number(name: str) -> float:
        return float(element.get(name, "0"))

    match named(element):
        case "rect":
            return number("x"), number("y"), number("x") + number("width"), number("y") + number("height")
        case "circle":
            cx, cy, r = number("cx"), number("cy"), number("r")
            return cx - r, cy - r, cx + r, cy + r
        case "polygon":
            points = [tuple(map(float, point.split(","))) for point in element.get("points").split()]
            across, down = zip(*points, strict=True)
            return min(across), min(down), max(across), max(down)
        case "text" if element.text:
            size = number("font-size")
            width, height = text_size(element.text, size, element.get("font-weight") == "bold")
            left = number("x") - (width / 2 if element.get("text-anchor") == "middle" else 0.0)
            return left, number("y") - height, left + width, number("y")
    return None
