"""`mmp report` with pictures of the cells and of chosen instances."""

import io
import json
import re
from base64 import b64decode

import numpy as np
import pytest
from PIL import Image
from support import bad_files
from support.picture_or_sentence import made, pixels_of_arm

from mmp_cli.reporting.instance_choice import choose
from mmp_cli.reporting.results import Line
from mmp_cli.reporting.sections import sections
from mmp_env.opengl import offscreen_backend

pytestmark = pytest.mark.usefixtures("figures_unrendered")

PICTURE = re.compile(r'<img src="data:image/webp;base64,([^"]+)" width="(\d+)" height="(\d+)" alt="([^"]*)">')


def line(instance, planner="ecbs", status="solved", time_s=1.0, **more):
    out = {"instance": instance, "planner": planner, "seed": 0, "status": status, "planning_time_s": time_s}
    return out | {"cell": instance.partition("/")[0]} | more


def folder_of(path, lines, sources, **more):
    """Returns a benchmark folder of `ecbs` and `cbs` with their defaults."""
    planners = [{"label": name, "name": name, "options": {}} for name in ("ecbs", "cbs")]
    settings = {"schema": "mmp-bench/1", "sources": sources, "planners": planners, "count": 3, "task": "reach"} | more
    (path / "settings.json").write_text(json.dumps(settings))
    (path / "results.jsonl").write_text("".join(json.dumps(one) + "\n" for one in lines))
    return path


def chosen(lines):
    (section,) = sections([Line(**one) for one in lines])
    return {choice.kind: (choice.instance, choice.caption) for choice in choose(section)}


def test_quickest_hardest_and_unsolved_are_chosen_by_the_rule():
    lines = [
        line("ring/a", time_s=0.5), line("ring/a", "cbs", time_s=0.002),
        line("ring/b", time_s=0.1), line("ring/b", "cbs", "timeout", 10.0),
        line("ring/c", "ecbs", "timeout", 10.0), line("ring/c", "cbs", time_s=7.0),
        line("ring/d", time_s=9.0), line("ring/d", "cbs", time_s=8.0),
        line("ring/e", "ecbs", "timeout", root_conflicts=3), line("ring/e", "cbs", "exhausted"),
        line("ring/f", "ecbs", "timeout", root_conflicts=9), line("ring/f", "cbs", "error"),
        line("ring/g", "ecbs", "invalid", root_conflicts=99),
    ]  # fmt: skip
    assert chosen(lines) == {
        "quickest": ("ring/a", "Quickest: instance a, in 2.00 ms by cbs."),
        "hardest": ("ring/c", "Hardest solved, by 1 of 2 planners: instance c, in 7.00 s by cbs."),
        "unsolved": ("ring/f", "Unsolved: instance f."),
    }


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            [line("ring/a", time_s=2.0)],
            {"quickest": ("ring/a", "Only solved, by 1 of 1 planner: instance a, in 2.00 s by ecbs.")},
        ),
        (
            [line("ring/a", status="timeout"), line("ring/b", status="timeout")],
            {"unsolved": ("ring/a", "Unsolved: instance a.")},
        ),
        ([line("ring/a", status="invalid")], {}),
        (
            [line("ring/a", time_s=0.5), line("ring/b", time_s=2.0), line("ring/b", "cbs")],
            {"quickest": ("ring/a", "Quickest and hardest solved, by 1 of 2 planners: instance a, in 500 ms by ecbs.")},
        ),
    ],
)
def test_missing_kinds_of_instances_are_not_chosen(lines, expected):
    assert chosen(lines) == expected


def test_a_page_has_pictures_of_the_cell_and_of_instances_inside_and_beside(mmp, tmp_path):
    lines = [line("MultiArmCell-2/0", time_s=0.1), line("MultiArmCell-2/1"), line("MultiArmCell-2/2", "cbs", "timeout")]
    folder = folder_of(tmp_path, lines, ["MultiArmCell-2"])
    ran = mmp("report", folder)
    page = (folder / "report.html").read_text()
    pictures = PICTURE.findall(page)
    if made(offscreen_backend) is None:
        assert (ran.code, pictures) == (0, [])
        return
    assert "4 pictures" in ran.out
    assert [caption.partition(":")[0] for *_, caption in pictures] == [
        "The cell", "Quickest", "Hardest solved, by 1 of 2 planners", "Unsolved",
    ]  # fmt: skip
    assert "the shortest time" in page
    names = ["cell-MultiArmCell-2", "quickest-MultiArmCell-2", "hardest-MultiArmCell-2", "unsolved-MultiArmCell-2"]
    assert {path.stem for path in folder.glob("*-MultiArmCell-2.png")} >= set(names)
    seen = set()
    for name, (data, width, height, _) in zip(names, pictures, strict=True):
        seen.add(data)
        with Image.open(io.BytesIO(b64decode(data))) as image, Image.open(folder / f"{name}.png") as beside:
            assert image.size == beside.size == (int(width), int(height))
            pixels = beside.convert("RGB")
        assert all(pixels_of_arm(np.asarray(pixels), number) > 100 for number in range(2))
    assert len(seen) == 4
    assert len(page) < 150_000


def test_a_report_removes_outdated_pictures_of_an_earlier_report_and_nothing_else(mmp, tmp_path, monkeypatch):
    folder = folder_of(tmp_path, [line("MultiArmCell-2/0"), line("MultiArmCell-2/1", time_s=2.0)], ["MultiArmCell-2"])
    assert mmp("report", folder).code == 0
    page = {path.name for path in folder.iterdir()}
    outdated = {"unsolved-MultiArmCell-2.png", "published-MultiArmCell-2.svg", "published-MultiArmCell-2-2.png"}
    mine = {"cell-mine.png", "MultiArmCell-2.png", "cell-MultiArmCell-2.jpg", "my-cell-MultiArmCell-2.png"}
    for name in outdated | mine | {"cell-MultiArmCell-2.png", "hardest-MultiArmCell-2.png"}:
        (folder / name).write_bytes(b"")
    monkeypatch.setenv("MUJOCO_GL", "disable")
    assert mmp("report", folder).code == 0
    pictures = {name for name in page if re.match("(cell|quickest|hardest)-.*png", name)}
    assert {path.name for path in folder.iterdir()} == page - pictures | mine
    assert "cactus-MultiArmCell-2.svg" in page


def test_instances_of_a_file_have_pictures_too_and_a_changed_file_has_none(mmp, tmp_path):
    source = tmp_path / "pairs.json"
    source.write_text(json.dumps(bad_files.good_instances()))
    cell = bad_files.good_instances()["cell"]["name"]
    folder = folder_of(tmp_path, [line(f"{cell}/turn"), line(f"{cell}/outside", status="invalid")], [str(source)])
    assert mmp("report", folder).code == 0
    count = len(PICTURE.findall((folder / "report.html").read_text()))
    assert count == (0 if made(offscreen_backend) is None else 2)
    folder_of(tmp_path, [line(f"{cell}/turn")], [str(source)], digests=["another"])
    assert mmp("report", folder).code == 0
    page = (folder / "report.html").read_text()
    assert not PICTURE.findall(page)
    assert count == 0 or "it is not what it was when the benchmark was run" in page


@pytest.mark.parametrize(
    ("source", "mujoco_gl", "sentence"),
    [
        ("MultiArmCell-2", "disable", "No pictures: MUJOCO_GL is disable, which forbids pictures"),
        ("gone.json", "", "No pictures of gone.json: "),
    ],
)
def test_a_report_without_pictures_says_why_in_one_line(mmp, tmp_path, monkeypatch, source, mujoco_gl, sentence):
    if mujoco_gl:
        monkeypatch.setenv("MUJOCO_GL", mujoco_gl)
    folder = folder_of(tmp_path, [line("MultiArmCell-2/0")], [source])
    assert mmp("report", folder).code == 0
    text = (folder / "table.md").read_text()
    assert text.count("No pictures") == 1
    assert sentence in text or made(offscreen_backend) is None
    assert "Quickest" not in (folder / "report.html").read_text()
    assert not list(folder.glob("cell-*.png"))
