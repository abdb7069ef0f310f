"""Hooks of the documentation site: turns the help of each command, and the tutorials that are programs, into Markdown.

MkDocs calls the functions whose names begin with `on_`; Griffe, which reads the docstrings, calls `OrdinaryNames`.
"""

from __future__ import annotations

import importlib
import json
import os
import re
from pathlib import Path
from typing import Any

import griffe  # pyright: ignore[reportMissingImports] # extra `docs`
from markdown import Extension, Markdown
from markdown.inlinepatterns import InlineProcessor
from mkdocs.structure.files import File  # pyright: ignore[reportMissingImports] # extra `docs`

_HELP = re.compile(r"^<!-- help: (\w+) -->$", re.MULTILINE)
_MARK = re.compile(r"<!-- (?:figure|table|checked|file|end)\b.*?-->", re.DOTALL)
_PROGRAM = re.compile(r"(\]\([^)\s]*(?:plan_and_look|compare_trees|clone_an_expert))\.(?:ipynb|py)\)")
_CELL = re.compile(r"^# %%(.*)\n", re.MULTILINE)
PROGRAMS = ("tutorials/plan_and_look.ipynb", "tutorials/compare_trees.py", "tutorials/clone_an_expert.ipynb")
"""Tutorials that run: a notebook, and a script with cells."""


class _Brackets(InlineProcessor):
    """Keeps `[rad]` as text, which the site would take for a link to something called `rad`."""

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str, int, int]:
        return m[0], m.start(0), m.end(0)


class _PlainBrackets(Extension):
    def extendMarkdown(self, md: Markdown) -> None:
        md.inlinePatterns.register(_Brackets(r"(?<!\])\[[^\[\]]*\](?![(\[])", md), "brackets", 171)


class OrdinaryNames(griffe.Extension):
    """Leaves `__repr__` and other special methods out of the API pages."""

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        for name in [name for name in cls.members if name.startswith("__") and name != "__init__"]:
            cls.del_member(name)


def on_config(config: Any) -> Any:
    """Adds the Markdown extension for units in brackets."""
    config.markdown_extensions.append(_PlainBrackets())
    return config


def on_files(files: Any, config: Any) -> Any:
    """Adds a page for each tutorial that is a program."""
    for program in PROGRAMS:
        text = (Path(config.docs_dir) / program).read_text(encoding="utf-8")
        page = notebook_page(text) if program.endswith(".ipynb") else script_page(text)
        target = str(Path(program).with_suffix(".md"))
        files.append(File.generated(config, target, content=f"{page}\n\n{_source(program)}\n"))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Inserts the help of a command at each `<!-- help: COMMAND -->`; links to programs become links to pages.

    Drops the marks of figures and tables, which would end a paragraph.
    """
    markdown = _HELP.sub(lambda mark: f"```text\n{command_help(mark[1])}```", markdown)
    markdown = _MARK.sub("", markdown)
    if page.file.generated_by:
        return markdown
    return _PROGRAM.sub(r"\1.md)", markdown)


def command_help(command: str) -> str:
    """Returns the help text of a command, as wide as a page."""
    os.environ["COLUMNS"] = "100"
    return importlib.import_module(f"mmp_cli.{command}").parser().format_help()


def notebook_page(text: str) -> str:
    """Returns the Markdown and code cells of a notebook as one page."""
    cells = json.loads(text)["cells"]
    return "\n\n".join(_cell("".join(cell["source"]), code=cell["cell_type"] == "code") for cell in cells)


def script_page(text: str) -> str:
    """Returns the cells of a script, which `# %%` separates, as one page."""
    _, *parts = _CELL.split(text)
    cells = zip(parts[::2], parts[1::2], strict=True)
    return "\n\n".join(
        _cell(
            re.sub(r"^# ?", "", body, flags=re.MULTILINE) if "markdown" in kind else body, code="markdown" not in kind
        )
        for kind, body in cells
    )


def _cell(text: str, *, code: bool) -> str:
    return f"```python\n{text.strip()}\n```" if code else text.strip()


def _source(program: str) -> str:
    return f"The program: [{Path(program).name}]({Path(program).name})."
