"""A plan in a Jupyter notebook: a small film, or pictures where a page cannot hold a film."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Container
from contextlib import suppress
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.sim.execution import ExecutionReport
from mmp_env.view.films import save_film
from mmp_env.view.pictures import encoded, pictures
from mmp_env.wording import in_seconds

Bundle = dict[str, str | bytes]
"""MIME type -> content."""


class PlanView:
    """Shows itself as a film of `width` x `height` pixels and `fps` frames a second, made when it is first looked at.

    `IPython.display.display(view, include=["image/png"])` shows a picture of start, middle and end instead.
    `fine` and `tool_paths` are as in `save_film`. If no picture can be made, the view is a sentence that says why.
    """

    def __init__(
        self,
        plan: Plan,
        report: ExecutionReport | None = None,
        *,
        width: int = 480,
        height: int = 360,
        fps: float = 8.0,
        fine: bool = False,
        tool_paths: bool = True,
    ) -> None:
        self._plan, self._report = plan, report
        self._size, self._fps = (width, height), fps
        self._fine, self._tool_paths = fine, tool_paths

    def __repr__(self) -> str:
        return f"<a plan for {len(self._plan.problem.cell.arms)} arms, {in_seconds(self._plan.makespan_s)}>"

    def _repr_html_(self) -> str:
        try:
            film = b64encode(self._film).decode()
        except MmpError as error:
            return f"<p>{escape(str(error))}</p>"
        width, height = self._size
        return f'<img src="data:image/webp;base64,{film}" width="{width}" height="{height}" alt="{escape(repr(self))}">'

    def _repr_mimebundle_(self, include: Container[str] | None = None, exclude: Container[str] | None = None) -> Bundle:
        """Returns the representations that IPython asks for; by default text and film, no picture."""

        def asked(kind: str, usual: bool) -> bool:
            return (kind in include if include else usual) and kind not in (exclude or ())

        out: Bundle = {"text/plain": repr(self)} if asked("text/plain", True) else {}
        if asked("text/html", True):
            out["text/html"] = self._repr_html_()
        if asked("image/png", False):
            with suppress(MmpError):  # there is none, and asking for the page says why
                out["image/png"] = self._picture
        return out

    @cached_property
    def _film(self) -> bytes:
        width, height = self._size
        with TemporaryDirectory() as folder:
            path = Path(folder) / "plan.webp"
            save_film(
                self._plan,
                path,
                self._report,
                fps=self._fps,
                width=width,
                height=height,
                fine=self._fine,
                tool_paths=self._tool_paths,
            )
            return path.read_bytes()

    @cached_property
    def _picture(self) -> bytes:
        width, height = (side * 2 // 3 for side in self._size)
        return encoded(pictures(self._plan, width=width, height=height, tool_paths=self._tool_paths))
