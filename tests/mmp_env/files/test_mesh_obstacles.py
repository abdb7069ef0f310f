"""Mesh obstacles: their fields, files, pieces and faults."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.files.mesh_file import read_pieces

CUBE = [[x, y, z] for x, y, z in itertools.product((-0.1, 0.1), repeat=3)]
BRICK = """solid brick
{facets}endsolid brick
"""


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def cell(path: Path | str = "cell.json", **mesh: object):
    fixture = {"name": "fixture", "shape": "mesh", "position": [0.5, 0, 0.4], **mesh}
    arm = {"name": "arm", "robot": "ur5e", "position": [0, 0, 0]}
    return cell_from_dict({"arms": [arm], "obstacles": [fixture]}, str(path))


def write_box(path: Path, *, inwards: bool = False, sides: int = 12) -> Path:
    """Writes a cube with edges of 0.2 m as text STL."""
    vertices = np.array(CUBE)
    center = vertices.mean(axis=0)
    facets = []
    for axis, sign in itertools.product(range(3), (-1, 1)):
        face = vertices[vertices[:, axis] * sign > 0]
        for corners in (face[[0, 1, 2]], face[[3, 2, 1]]):
            outwards = np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ (corners[0] - center) > 0
            ordered = corners if outwards != inwards else corners[::-1]
            lines = "".join(f"vertex {x} {y} {z}\n" for x, y, z in ordered)
            facets.append(f"facet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\n")
    path.write_text(BRICK.format(facets="".join(facets[:sides])))
    return path


def test_a_written_cell_has_the_pieces_and_reads_back_the_same() -> None:
    before = cell_to_dict(cell(pieces=[CUBE, [[0, 0, 0.1], [0.1, 0, 0.1], [0, 0.1, 0.1], [0, 0, 0.3]]]))
    assert before["obstacles"][0]["shape"] == "mesh"
    assert cell_to_dict(cell_from_dict(json.loads(json.dumps(before)), "again.json")) == before


def test_a_file_is_found_beside_the_cell_and_becomes_pieces(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    pytest.importorskip("scipy")
    write_box(tmp_path / "brick.stl")
    (obstacle,) = cell(tmp_path / "cell.json", file="brick.stl", scale=2).obstacles
    (piece,) = obstacle.pieces
    assert np.ptp(piece, axis=0) == pytest.approx([0.4] * 3)
    assert "file" not in cell_to_dict(cell(tmp_path / "cell.json", file="brick.stl"))["obstacles"][0]


def test_a_second_reading_takes_the_pieces_from_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("trimesh")
    pytest.importorskip("scipy")
    first = read_pieces(write_box(tmp_path / "brick.stl"))
    monkeypatch.setattr("mmp_env.files.mesh_file._decomposed", None)
    second = read_pieces(tmp_path / "brick.stl")
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_a_mirrored_mesh_is_not_inside_out(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    pytest.importorskip("scipy")
    (piece,) = read_pieces(write_box(tmp_path / "brick.stl"), [1, -1, 1])
    assert np.ptp(piece, axis=0) == pytest.approx([0.2] * 3)


def test_pieces_contain_every_vertex_of_a_round_mesh() -> None:
    spatial = pytest.importorskip("scipy.spatial")
    from mmp_env.meshes.mesh_pieces import outer_hull

    points = np.random.default_rng(0).normal(size=(3000, 3))
    points *= 0.1 / np.linalg.norm(points, axis=1, keepdims=True)
    outer = outer_hull(points)
    planes = spatial.ConvexHull(outer).equations
    assert len(outer) < 600
    assert (points @ planes[:, :3].T + planes[:, 3]).max() <= 0
    assert np.linalg.norm(outer, axis=1).max() <= 0.102 + 1e-5


def test_separate_parts_become_separate_pieces() -> None:
    pytest.importorskip("scipy")
    from mmp_env.meshes.mesh_pieces import mesh_pieces

    hull = pytest.importorskip("scipy.spatial").ConvexHull(CUBE)
    faces = np.array(hull.simplices)
    corners = hull.points[faces]
    flip = (
        np.einsum("ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]) < 0
    )
    faces[flip] = faces[flip][:, ::-1]
    vertices = np.vstack((hull.points, hull.points + np.array([1, 0, 0])))
    pieces = mesh_pieces(vertices, np.concatenate([faces, faces + len(CUBE)]))
    assert sorted(piece[:, 0].mean().round(6) for piece in pieces) == [0.0, 1.0]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "obstacles[0].file is missing; a mesh needs file"),
        ({"pieces": []}, "obstacles[0].pieces has 0 entries; a mesh has 1 to 200 convex pieces"),
        ({"pieces": [CUBE[:3]]}, "obstacles[0].pieces[0] has 3 vertices; a piece has 4 to 1000"),
        ({"pieces": [CUBE[:4]]}, "obstacles[0].pieces[0] is flat"),
        ({"pieces": [[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 101]]]}, "pieces[0] has a vertex beyond 100 m"),
        ({"pieces": [CUBE], "radius": 0.1}, "obstacles[0].radius is 0.1; a mesh has pieces only"),
        ({"pieces": [CUBE], "scale": 2}, "obstacles[0].scale is 2.0; a mesh has pieces only"),
        ({"file": "brick.stl", "scale": 0}, "obstacles[0].file: scale is 0"),
        ({"file": "brick.stl", "scale": [1, 2]}, "scale is [1.0, 2.0]; it must be one number or three"),
        ({"file": "brick.txt"}, "has the suffix '.txt'; a mesh file has one of .stl, .obj"),
        ({"file": "nowhere.stl"}, "nowhere.stl does not exist"),
        ({"file": "inverted.stl"}, "inverted.stl is inverted: its triangles point inwards; flip them"),
        ({"file": "open.stl"}, "open.stl is not manifold"),
        ({"file": "empty.stl"}, "empty.stl holds no triangles"),
        ({"file": "brick.stl", "scale": 1e4}, "reaches 1000 m from its origin; 100 m is the most"),
    ],
)
def test_a_fault_gets_one_sentence_with_its_field(tmp_path: Path, fields: dict[str, object], message: str) -> None:
    if "file" in fields:
        pytest.importorskip("trimesh")
        pytest.importorskip("scipy")
    write_box(tmp_path / "brick.stl")
    write_box(tmp_path / "inverted.stl", inwards=True)
    write_box(tmp_path / "open.stl", sides=8)
    (tmp_path / "empty.stl").write_text("")
    with pytest.raises(MmpError) as caught:
        cell(tmp_path / "cell.json", **fields)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_arm_holds_no_mesh() -> None:
    arm = {"name": "arm", "robot": "ur5e", "position": [0, 0, 0], "held": {"shape": "mesh", "position": [0, 0, 0]}}
    with pytest.raises(MmpError, match=r"held\.shape is 'mesh'; an arm holds a box, sphere, cylinder or capsule"):
        cell_from_dict({"arms": [arm]}, "cell.json")
