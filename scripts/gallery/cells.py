"""A picture of several cells with different arms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from gallery.fonts import INK, font
from mmp_env import MmpError, draw_instance, find_cell
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.files.reading import Location, parse_yaml
from mmp_env.files.writing import whole_file
from mmp_env.model.cell import Cell
from mmp_env.view.offscreen_renderer import OffscreenRenderer

README = Path(__file__).parents[2] / "README.md"
NAMES = ("ring-8", "ring-8-panda", "ring-6-fr5")
_SIZE, _GAP, _WORDS = (412, 330), 8, 0.048
_SEED = 0


def save_cells(path: Path) -> None:
    """Writes the picture of built-in rings and of the cell in the README."""
    cells = [*(find_cell(name) for name in NAMES), readme_cell()]
    with whole_file(path) as temporary:
        Image.fromarray(cells_picture(cells)).save(temporary, "WEBP", quality=84, method=6)


def cells_picture(cells: list[Cell], size: tuple[int, int] = _SIZE) -> UInt8[np.ndarray, "h w 4"]:
    """Returns the cells side by side at the start of a random instance, with their names; the gaps are transparent."""
    width, height = size
    letters = _WORDS * width
    out = Image.new("RGBA", (len(cells) * (width + _GAP) - _GAP, height))
    draw = ImageDraw.Draw(out)
    for k, cell in enumerate(cells):
        start, _ = draw_instance(cell, seed=_SEED)
        left = k * (width + _GAP)
        with OffscreenRenderer(cell, width, height) as renderer:
            out.paste(Image.fromarray(renderer.picture(start)), (left, 0))
        draw.text((left + width / 2, 1.2 * letters), _caption(cell), INK, font(letters), anchor="mm")
    return np.array(out)


def readme_cell() -> Cell:
    """Returns the cell that the README has as YAML."""
    block = re.search(r"^```yaml\n(.*?)^```$", README.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    if block is None:
        raise MmpError(f"{README} has no cell in YAML")
    place = Location(README.name)
    return cell_from_dict(parse_yaml(block[1], place), place)


def _caption(cell: Cell) -> str:
    kinds = {arm.robot.name: 0 for arm in cell.arms}
    for arm in cell.arms:
        kinds[arm.robot.name] += 1
    return f"{cell.name}: " + ", ".join(f"{count} {name}" for name, count in kinds.items())
