"""The documentation site: its navigation names every page, and each package and command has its place."""

import ast
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from mmp_cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PACKAGES = ("mmp_env", "planners/mmp_planners", "tasks/mmp_tasks")
PROGRAMS = {"tutorials/plan_and_look.md", "tutorials/compare_trees.md", "tutorials/clone_an_expert.md"}
"""Pages that scripts/site_hooks.py makes from programs."""
UNLISTED = {"mmp_env.mujoco_import"}
"""Modules with `__all__` that are not for users."""


class Config(yaml.SafeLoader):
    """Reads mkdocs.yml, whose tags name Python objects."""


Config.add_multi_constructor("tag:yaml.org,2002:python/", lambda loader, suffix, node: None)
NAV = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), Config)["nav"]


def listed(entry):
    """Returns the pages of a part of the navigation."""
    if isinstance(entry, str):
        return [entry]
    return [page for part in (entry if isinstance(entry, list) else entry.values()) for page in listed(part)]


def exporting_modules():
    """Returns the names of all modules with `__all__`."""
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            if any(isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__" for node in tree.body):
                parts = path.relative_to((ROOT / package).parent).with_suffix("").parts
                yield ".".join(parts).removesuffix(".__init__")


def test_the_navigation_names_every_page_once():
    pages = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")}
    pages -= {str(page.relative_to(DOCS)) for page in DOCS.glob("results/*/table.md")}
    assert sorted(listed(NAV)) == sorted(pages | PROGRAMS)


def test_the_programs_of_the_tutorials_exist():
    stems = {path.stem for path in (DOCS / "tutorials").iterdir() if path.suffix in (".py", ".ipynb")}
    assert {Path(page).stem for page in PROGRAMS} == stems


def test_every_module_that_exports_names_has_an_api_page():
    assert {page.stem for page in (DOCS / "reference" / "api").glob("*.md")} == {*exporting_modules()} - UNLISTED


def test_an_api_page_documents_the_module_that_it_is_named_after():
    for page in (DOCS / "reference" / "api").glob("*.md"):
        assert re.findall(r"^::: (\S+)$", page.read_text(encoding="utf-8"), re.MULTILINE) == [page.stem]


def test_the_help_of_every_command_stands_on_the_page_of_the_command_line():
    text = (DOCS / "reference" / "cli.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^<!-- help: (\w+) -->$", text, re.MULTILINE)) == COMMANDS.keys()


def test_every_page_begins_with_one_title():
    for page in DOCS.rglob("*.md"):
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        assert text.startswith("# "), page
        assert len(re.findall(r"^# ", text, re.MULTILINE)) == 1, page


def test_a_list_follows_an_empty_line_because_the_site_needs_one():
    for page in DOCS.rglob("*.md"):
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        glued = re.findall(r"^(?!\s*(?:[-*]|\d+\.)\s|\s|\||<!--)\S.*\n(?=(?:-|1\.) )", text, re.MULTILINE)
        assert glued == [], page


def test_the_site_builds_without_a_warning(tmp_path):
    if importlib.util.find_spec("mkdocs") is None:
        pytest.skip("MkDocs is not installed; scripts/docs.sh installs the extra `docs`")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
