"""A watcher that records the conflict tree of a search and draws it."""

from __future__ import annotations

from os import PathLike

from mmp_env.files.writing import write_text
from mmp_env.view.tree_drawing import draw_tree
from mmp_env.view.tree_record import TreeRecord


class SearchTree(TreeRecord):
    """A watcher that records the conflict tree of a search and draws it. In a notebook it displays itself."""

    def svg(self) -> str:
        """Returns the drawing as the text of an SVG file."""
        return draw_tree(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the drawing to an SVG file, complete or not at all. Raises `MmpError` if it cannot be written."""
        write_text(path, self.svg())

    def _repr_svg_(self) -> str:
        return self.svg()
