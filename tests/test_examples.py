"""The tutorials and the programs of the pages run, and a notebook can show their results."""

import ast
import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
from support.picture_or_sentence import made
from support.scenes import scene

from mmp_cli.main import main
from mmp_env.opengl import offscreen_backend

FOLDER = Path(__file__).parents[1] / "docs" / "tutorials"
EXAMPLES = sorted(path for path in FOLDER.iterdir() if path.suffix in (".py", ".ipynb"))


def cells(path: Path) -> list[str]:
    """Returns the code cells of a notebook, or of a script with `# %%` between them."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        return ["".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    return [cell for cell in re.split(r"^# %%", text, flags=re.MULTILINE) if not cell.startswith(" [markdown]")]


def run(path: Path) -> list[object]:
    """Runs the cells and returns the values of their last lines."""
    names: dict[str, object] = {"__name__": "__main__"}
    out = []
    for cell in cells(path):
        tree = ast.parse(cell, str(path))
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, str(path), "exec"), names)
        if last is not None:
            out.append(eval(compile(ast.Expression(last.value), str(path), "eval"), names))
    return [value for value in out if value is not None]


def run_page(name: str) -> dict[str, Any]:
    """Runs the Python programs of a page one after the other and returns their names."""
    page = (FOLDER.parent / name).read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for program in re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE):
        exec(program, names)
    return names


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_the_cells_of_an_example_run_and_show_something(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shown = run(path)
    assert capsys.readouterr().out
    assert shown
    for value in shown:
        if hasattr(value, "_repr_svg_"):
            assert ElementTree.fromstring(value._repr_svg_()).get("viewBox")
        else:
            assert ("base64" in value._repr_html_()) == (made(offscreen_backend) is not None)


def test_the_first_cell_of_the_tutorial_is_planned(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = (FOLDER / "first-cell.md").read_text(encoding="utf-8")
    Path("bench.yaml").write_text(page.partition("```yaml\n")[2].partition("```")[0], encoding="utf-8")
    assert run_page("tutorials/first-cell.md")["report"].valid
    assert re.search(r"^cost +(\S+ rad),", page, re.MULTILINE)[1] in capsys.readouterr().out


def test_the_tool_poses_of_the_tutorial_become_a_motion(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = run_page("tutorials/tool-poses.md")
    assert names["report"].valid
    assert names["motion"].retimed
    assert (tmp_path / "motion.json").exists()
    assert "candidates, the nearest" in capsys.readouterr().out


def test_the_programs_of_the_page_on_searches_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_page("how-to/watch-a-search.md")
    assert ElementTree.parse(tmp_path / "tree.svg").getroot().get("viewBox")
    assert "arm2 and arm3 are in conflict at 1.9 s" in capsys.readouterr().out


def test_the_program_of_planning_online_runs():
    names = run_page("how-to/plan-while-moving.md")
    assert names["step"].kind in ("continuation", "stop")
    assert names["q"].keys() == set(names["cell"].arm_names)
    assert names["truncated"]
    assert not names["info"]["contacts"]


def test_the_program_of_learning_reads_a_dataset(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["dataset", "MultiArmCell-2", "--count", "2", "--out", "experts"]) == 0
    names = run_page("how-to/learn-from-experts.md")
    assert len(names["inputs"]) == len(names["targets"]) > 10


def test_the_programs_of_the_page_on_pictures_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made(lambda: run_page("how-to/pictures.md") or True)
    if any(tmp_path.iterdir()):
        assert {path.name for path in tmp_path.iterdir()} == {"plan.png", "meeting.jpg", "above.png", "plan.mp4"}


def test_the_programs_of_the_page_on_recordings_run_from_top_to_bottom(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page("how-to/rerun.md")
    assert {path.name for path in tmp_path.iterdir()} == {"search.rrd", "tree.rrd", "episodes.rrd"}
    assert names["result"].plan is not None


def test_the_program_of_the_page_on_scenes_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    ready = '<keyframe><key name="ready" qpos="-0.6 1.3 0.3 2.5 1.3 0"/></keyframe>'
    Path("two_arms.xml").write_text(scene(after=ready), encoding="utf-8")
    report = run_page("how-to/plan-in-your-scene.md")["report"]
    assert report.reached
    assert not report.contacts
    assert capsys.readouterr().out.startswith("True []")


def test_notebooks_are_kept_without_output():
    for path in FOLDER.glob("*.ipynb"):
        assert all(not cell.get("outputs") for cell in json.loads(path.read_text(encoding="utf-8"))["cells"])
