"""`scripts/make_gallery.sh`: its parts work on small cells, and choose instances by their rules."""

import importlib
import re
import sys
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from support.picture_or_sentence import made, pixels_of_arm

from mmp_env import ring_cell
from mmp_env.errors import MmpError
from mmp_env.model.conflict import plan_conflicts
from mmp_env.sim.scene_appearance import OBJECT_RGBA

ROOT = Path(__file__).parents[1]
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def part():
    """Returns a module of the gallery by name. It is last on the path, so packages are the installed ones."""
    sys.path.append(str(ROOT / "scripts"))
    yield lambda name: importlib.import_module(f"gallery.{name}")
    sys.path.remove(str(ROOT / "scripts"))


def test_the_drawing_of_two_trees_has_the_means_of_the_results(part):
    figures = importlib.import_module("measured").read_figures()
    mean = {name: figures[f"MultiArmCell-8/{name}/expanded_nodes_mean"]["value"] for name in ("ecbs", "apf-ecbs")}
    drawing = (ROOT / "docs/images/gallery/trees.svg").read_text(encoding="utf-8")
    ratio = mean["ecbs"] / mean["apf-ecbs"]
    assert f"to that of the means, {ratio:.1f}: {mean['ecbs']:.1f} against {mean['apf-ecbs']:.1f} nodes." in drawing


@pytest.fixture(scope="module")
def small(part):
    """Returns a search whose root is branched on."""
    run = part("instances").search("apf-ecbs", 2, 4)
    assert run.expanded > 0
    return run


def test_the_animation_has_a_ring_around_each_conflict_and_ends_with_the_plan(part, small, tmp_path):
    film = part("film")
    shots = made(lambda: list(film.film(small, width=466, height=240, frame_ms=2000, fine=False)))
    if shots is None:
        return
    assert {shot.picture.shape for shot in shots} == {(240, 466, 3)}
    rings = sum((np.abs(shot.picture.astype(int) - film.ALARM).max(axis=2) < 12).sum() > 40 for shot in shots)
    assert rings >= small.expanded
    plays_s = sum(shot.duration_ms for shot in shots if shot.duration_ms == 2000) / 1e3
    assert plays_s >= small.plan.makespan_s - 2
    for number in range(4):
        assert pixels_of_arm(shots[-1].picture[:, : 466 - film.PANEL], number) > 15
    film.write_webp(tmp_path / "film.webp", shots)
    with Image.open(tmp_path / "film.webp") as image:
        assert image.n_frames == len(shots)


def test_the_panel_shows_the_growing_tree_and_the_solution_path_at_the_end(part, small):
    panel = part("tree_panel").TreePanel(small.tree, 306, 300)
    pictures = [panel.picture(shown) for shown in range(len(small.tree.nodes) + 1)]
    pictures.append(panel.picture(len(small.tree.nodes), solved=True))
    for before, after in pairwise(pictures):
        assert (before != after).any()


def test_a_point_in_the_world_is_where_the_picture_has_it(part):
    cell = ring_cell(2)
    tucked = {arm.name: np.array(arm.robot.tucked) for arm in cell.arms}

    def find():
        with part("cell_view").CellView(cell, 200, 150, (10, 20, 0, 0)) as view:
            ball = part("cell_view").Line(
                points=np.array([[0.0, 0.6, 0.3], [0.0, 0.6, 0.301]]), rgba=(1.0, 0.0, 0.0, 1.0), thickness=0.1
            )
            return view.picture(tucked, [ball]), view.picture(tucked), view.pixel(np.array([0.0, 0.6, 0.3]))

    found = made(find)
    if found is None:
        return
    with_ball, without, (x, y) = found
    rows, columns = np.nonzero((with_ball != without).any(axis=2))
    assert abs(columns.mean() - x) < 2
    assert abs(rows.mean() - y) < 2


def test_both_trees_are_drawn_whole_with_the_means_below(part, small):
    comparison = part("comparison")
    other = part("instances").search("ecbs", 2, 4)
    figures = {comparison._BOTH: {"value": 88.0, "ratio": 5.5, "instances": 50}}
    root = ET.fromstring(comparison.comparison(other, small, figures))
    drawn = [group for group in root.iter(f"{SVG}g") if group.get("class") == "mmp-node"]
    assert len(drawn) == len(other.tree.nodes) + len(small.tree.nodes)
    text = " ".join(element.text or "" for element in root.iter(f"{SVG}text"))
    assert "88.0 against 16.0 nodes" in text
    assert f"{other.expanded} nodes expanded" in text


def test_a_planner_drawing_has_one_tool_path_for_each_arm(part, small):
    (text,) = part("tool_paths").drawings([small])
    root = ET.fromstring(text)
    assert len(list(root.iter(f"{SVG}path"))) == 2 * 4
    numbers = [float(n) for path in root.iter(f"{SVG}path") for n in re.findall(r"[\d.]+", path.get("d", ""))]
    assert min(numbers) >= 0
    assert max(numbers) <= float(root.get("width", "0"))


def test_the_row_of_cells_is_as_wide_as_its_pictures(part):
    cells = part("cells")
    picture = made(lambda: cells.cells_picture([ring_cell(2), cells.readme_cell()], (120, 90)))
    if picture is not None:
        assert picture.shape == (90, 2 * 120 + cells._GAP, 4)
        assert (picture[:, 120 : 120 + cells._GAP, 3] == 0).all()


def stand_in(nodes: int, *, trees: int = 1, fast: bool = True, expanded: int = 1):
    tree = SimpleNamespace(roots=[0] * trees, nodes=[0] * nodes, solution_path=[SimpleNamespace(fast_track=fast)])
    return SimpleNamespace(tree=tree, expanded=expanded)


def test_the_animation_is_of_the_first_seed_with_a_small_tree_that_comes_through_the_fast_track(part, monkeypatch):
    instances = part("instances")
    runs = [stand_in(11), stand_in(5, trees=2), stand_in(5, fast=False), stand_in(2), stand_in(10), stand_in(4)]
    monkeypatch.setattr(instances, "search", lambda planner, seed, arms: runs[seed])
    assert instances.first_small(range(6)) is runs[4]
    with pytest.raises(MmpError, match="none of the seeds"):
        instances.first_small(range(4))


def test_the_typical_instance_has_the_ratio_nearest_to_that_of_the_means(part, monkeypatch):
    instances = part("instances")
    counts = {"ecbs": [5, 55, 11], "apf-ecbs": [0, 10, 1]}
    monkeypatch.setattr(instances, "search", lambda name, seed, arms: stand_in(5, expanded=counts[name][seed]))
    first, second = instances.typical(5.1, range(3))
    assert (first.expanded, second.expanded) == (55, 10)
    with pytest.raises(MmpError, match="none of the seeds"):
        instances.typical(5.1, range(1))


def test_the_hit_of_the_fast_track_is_the_one_on_the_page_and_resolves_the_conflict(part):
    fast_track = part("fast_track")
    hit = fast_track.first_hit()
    assert hit.sentence() in (ROOT / "docs" / "explanation" / "paper.md").read_text(encoding="utf-8")
    assert hit.node == 0
    assert hit.clearance_m(hit.before) < 0 < hit.clearance_m(hit.after)
    assert plan_conflicts(hit.run.problem.cell.collision, hit.after) == []
    for arm, q in hit.before.positions.items():
        same = q.shape == hit.after.positions[arm].shape and np.allclose(q, hit.after.positions[arm])
        assert same == (arm != hit.critical)
    picture = made(lambda: fast_track.hit_picture(hit, size=(210, 180), whole=(500, 390)))
    if picture is not None:
        assert picture.shape[1] == 2 * 210
        assert (np.abs(picture.astype(int) - part("fonts").ALARM).max(axis=2) < 12).sum() > 40


def test_a_demonstration_is_planned_executed_and_filmed(part, tmp_path):
    demonstrations = part("demonstrations")
    film = tmp_path / "film.webp"
    if made(lambda: demonstrations.save_demonstration("pick", film, size=(96, 64), fps=1.0) or film) is None:
        return
    with Image.open(film) as image:
        assert image.n_frames > 2


def test_arms_at_work_are_filmed_as_they_are_executed(part, tmp_path):
    executions, small = part("executions"), {"size": (96, 64), "fps": 0.5}

    def films():
        executions.save_work(tmp_path / "work.webp", parts=4, **small)
        executions.save_online(tmp_path / "online.webp", seconds=16.0, cell="ring-2", **small)
        return True

    if made(films) is None:
        return
    for name in ("work", "online"):
        with Image.open(tmp_path / f"{name}.webp") as image:
            assert image.n_frames >= 2, name


@pytest.mark.parametrize("name", ["work", "online"])
def test_the_films_of_arms_at_work_are_small_and_show_what_they_carry(name):
    path = ROOT / "docs" / "images" / "gallery" / f"{name}.webp"
    assert path.stat().st_size < 0.5e6
    with Image.open(path) as film:
        assert film.n_frames > 20
        if name == "work":
            assert pixels_of_objects(np.asarray(film.convert("RGB"))) > 400


@pytest.mark.parametrize("task", ["crossing", "parallel", "pick", "place", "packing"])
def test_the_film_of_a_task_is_large_and_always_shows_its_objects(task):
    path = ROOT / "docs" / "images" / "gallery" / f"task-{task}.webp"
    assert path.stat().st_size < 1e6
    with Image.open(path) as film:
        assert film.width >= 640
        assert film.height >= 480
        for k in range(film.n_frames if task in ("pick", "place", "packing") else 0):
            film.seek(k)
            assert pixels_of_objects(np.asarray(film.convert("RGB"))) > 400, k


def pixels_of_objects(image):
    """Returns the number of pixels with the hue of objects that arms can hold."""
    pixels = image.reshape(-1, 3) / np.maximum(np.linalg.norm(image.reshape(-1, 3), axis=1), 1)[:, None]
    color = np.array(OBJECT_RGBA[:3])
    return int((pixels @ (color / np.linalg.norm(color)) > 0.985).sum())


def test_the_ring_of_imported_robots_stands_around_its_table_and_names_a_robot_that_was_not_added(part):
    cell = part("imported").ring_of(("ur5e", "panda", "ur5e"))
    assert [arm.robot.name for arm in cell.arms] == ["ur5e", "panda", "ur5e"]
    assert cell.spheres == "exact"
    for arm in cell.arms:
        forward = arm.T_world_base[:3, 0]
        np.testing.assert_allclose(forward, -arm.position / np.linalg.norm(arm.position), atol=1e-9)
    with pytest.raises(MmpError, match="unknown robot 'no-such-arm'"):
        part("imported").ring_of(("no-such-arm",))


def test_the_film_of_many_arms_shows_both_rows_and_is_small():
    path = ROOT / "docs" / "images" / "gallery" / "many-arms.webp"
    assert path.stat().st_size < 0.5e6
    with Image.open(path) as film:
        assert film.n_frames > 20
        assert film.width > 5 * film.height


def test_the_curves_begin_with_the_plans_of_half_of_the_instances(part):
    line = {"seconds": [0.01, 0.1, 1.0], "solved": [0.25, 0.5, 1.0], "cost": [None, 1.5, 1.1]}
    drawn = part("curves").curves_picture({"ring-4": line, "line-64": line | {"cost": [None, None, 1.2]}})
    assert ET.fromstring(drawn).tag.endswith("svg")
    assert "ring-4" in drawn
    assert "line-64" in drawn
