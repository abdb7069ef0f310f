"""Reading URDF and MJCF: what comes out, and one sentence for everything that cannot be read."""

import math
import re
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from fuzz import mesh_samples
from support.small_arms import box_mesh, fingers, mjcf, urdf, with_mesh, write_obj

from mmp_env.errors import MmpError
from mmp_env.importing.chain import select_chain
from mmp_env.importing.chain_choice import ChainOptions
from mmp_env.importing.limits import limits_of
from mmp_env.importing.link_pieces import link_pieces, pieces_and_notes
from mmp_env.importing.source import prepare_source, read_source
from mmp_env.meshes.mesh_files import parse_mesh, read_mesh, refuse_words

VERTICES, FACES = box_mesh()
BALL_JOINT = 'type="ball"'


def written(folder, text):
    path = folder / ("arm.urdf" if "<robot" in text else "arm.xml")
    path.write_text(text)
    return path


def imported(path, **options):
    """The chain of a file, its pieces made."""
    chain = select_chain(read_source(path), ChainOptions(**options))
    for link in chain.links:
        link_pieces(chain, link)
    return chain


def test_a_urdf_keeps_its_velocity_limits_and_efforts(tmp_path):
    source = read_source(written(tmp_path, urdf()))
    assert source.velocity == {"turn": 1.5, "lift": 1.2}
    assert source.model.jnt_actfrcrange[:2].tolist() == [[-30, 30], [-20, 20]]


def test_a_urdf_may_use_prefixes_that_it_does_not_declare(tmp_path):
    text = urdf().replace('lower="-1.5"', 'drake:acceleration="2.5" lower="-1.5"').replace("</robot>", "<a:b/></robot>")
    assert imported(written(tmp_path, text)).joint_names == ("turn", "lift", "roll")


def test_an_inertia_that_no_body_has_is_replaced_and_the_mass_stays(tmp_path):
    text = urdf().replace('ixx="0.01" iyy="0.01" izz="0.01" ixy="0"', 'ixx="0" iyy="0" izz="0" ixy="1"')
    source = read_source(written(tmp_path, text))
    assert source.notes[0].startswith("links with an inertia that no body has get a small one: upper")
    model = source.model
    assert model.body("upper").mass[0] == pytest.approx(1.0)
    assert model.body("upper").inertia.min() > 0


def test_looks_are_left_out_even_where_their_files_are_missing(tmp_path):
    assert read_source(written(tmp_path, urdf())).model.nmesh == 0
    assert read_source(written(tmp_path, mjcf())).model.ngeom == 4


def test_a_package_path_is_found_in_the_folder_that_the_user_gave(tmp_path):
    (tmp_path / "else" / "arms" / "meshes").mkdir(parents=True)
    write_obj(tmp_path / "else" / "arms" / "meshes" / "box.obj", VERTICES, FACES)
    path = written(tmp_path, urdf(shape='<geometry><mesh filename="package://arms/meshes/box.obj"/></geometry>'))
    with pytest.raises(MmpError, match="package 'arms' cannot be found; --package-dir names"):
        read_source(path)
    for folder in (tmp_path / "else", tmp_path / "else" / "arms"):
        assert read_source(path, [folder]).model.nmesh == 1


def test_the_inputs_are_the_file_its_meshes_and_includes_and_the_folders_of_packages(tmp_path):
    source = with_mesh(tmp_path / "d.xml", VERTICES, FACES)
    (tmp_path / "extra.xml").write_text('<mujoco><option timestep="0.001"/></mujoco>')
    source.write_text(source.read_text().replace("<worldbody>", '<include file="extra.xml"/><worldbody>', 1))
    inputs = prepare_source(source, [tmp_path]).inputs
    assert set(inputs) == {source, tmp_path / "link.obj", tmp_path / "extra.xml", tmp_path}


def test_a_package_is_found_in_the_folders_above_the_file(tmp_path):
    folder = tmp_path / "arms" / "urdf"
    folder.mkdir(parents=True)
    write_obj(tmp_path / "arms" / "box.obj", VERTICES, FACES)
    path = written(folder, urdf(shape='<geometry><mesh filename="package://arms/box.obj"/></geometry>'))
    assert read_source(path).model.nmesh == 1


def test_two_meshes_of_one_name_in_two_folders_stay_apart(tmp_path):
    for folder, size in (("a", 0.1), ("b", 0.3)):
        (tmp_path / folder).mkdir()
        write_obj(tmp_path / folder / "link.obj", VERTICES * size, FACES)
    both = "".join(
        f'<collision><geometry><mesh filename="{folder}/link.obj"/></geometry></collision>' for folder in "ab"
    )
    text = urdf().replace('<link name="fore">', f'<link name="fore">{both}')
    model = read_source(written(tmp_path, text)).model
    sizes = [np.ptp(model.mesh_vert[8 * k : 8 * k + 8], axis=0).max() for k in range(2)]
    np.testing.assert_allclose(sorted(sizes), [0.01, 0.03], rtol=1e-6)


def test_a_change_of_a_mesh_changes_the_digest(tmp_path):
    path = with_mesh(tmp_path / "arm.xml", VERTICES, FACES)
    before = read_source(path).digest
    assert read_source(path).digest == before
    write_obj(tmp_path / "link.obj", VERTICES * 1.1, FACES)
    assert read_source(path).digest != before


def test_a_change_of_an_included_file_changes_the_digest(tmp_path):
    (tmp_path / "more.xml").write_text('<mujoco><worldbody><body name="other"/></worldbody></mujoco>')
    path = written(tmp_path, mjcf(after='<include file="more.xml"/>'))
    before = read_source(path).digest
    (tmp_path / "more.xml").write_text('<mujoco><worldbody><body name="another"/></worldbody></mujoco>')
    assert read_source(path).digest != before


CASES = {
    "no joints": ('<mujoco><worldbody><body name="b"><geom size="0.1"/></body></worldbody></mujoco>', "no hinge or"),
    "no collision geometry": (
        mjcf().replace("<asset>", '<default><geom contype="0" conaffinity="0"/></default><asset>'),
        "no collision geometry",
    ),
    "missing mesh": (mjcf(asset='<mesh name="m" file="no.stl"/>', geom='type="mesh" mesh="m"'), "no.stl, which does"),
    "package": (urdf(shape='<geometry><mesh filename="package://p/a.stl"/></geometry>'), "package 'p' cannot be found"),
    "limits missing": (urdf(limit=""), "joint 'lift' is revolute and has no limits"),
    "limits empty": (
        urdf(limit='<limit lower="1" upper="1" effort="1" velocity="1"/>'),
        "'lift' is revolute and has no",
    ),
    "URDF limits swapped": (
        urdf(limit='<limit lower="1" upper="-1" effort="1" velocity="1"/>'),
        "joint 'lift' has lower limit 1 and upper limit -1; swap them",
    ),
    "negative mass": (urdf().replace('<mass value="1"/>', '<mass value="-1"/>'), "'upper' has mass '-1'; it must be"),
    "a mass that is none": (urdf().replace('<mass value="1"/>', '<mass value="nan"/>'), "mass 'nan'; it must be"),
    "slide without limits": (mjcf(joint2='type="slide" limited="false"'), "slide joint 'a2' has no limits"),
    "limits swapped": (mjcf(joint2='range="2 -2"'), "joint 'a2' has the range from 2 to -2"),
    "two joints of one name": (mjcf().replace('"a3"', '"a2"'), "repeated name 'a2' in joint"),
    "two URDF joints of one name": (urdf().replace('"roll"', '"lift"'), "two joints with the name 'lift'"),
    "loop in URDF": (
        urdf(joints='<joint name="x" type="fixed"><parent link="base_link"/><child link="hand"/></joint>'),
        "closed loop: link 'hand' hangs on both 'fore' and 'base_link'",
    ),
    "loop by a constraint": (
        mjcf(after='<equality><connect body1="hand" body2="base" anchor="0 0 0"/></equality>'),
        "closed loop: equality constraint number 0 joins 'hand' and 'base'",
    ),
    "coupled joints": (mjcf(after='<equality><joint joint1="a3" joint2="a2"/></equality>'), "'a3' follow 'a2'"),
    "10,000 geoms": (mjcf(base='<geom size="0.01"/>' * 10_000), "has 10004 collision geoms; at most 1000"),
    "ball joint": (mjcf(joint2=BALL_JOINT), "joint 'a2' in the chain is a ball joint"),
    "height field": (
        mjcf(asset='<hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/>', geom='type="hfield" hfield="h"'),
        "is a height field",
    ),
    "not XML": ("<mujoco><worldbody>", "is not XML"),
    "not a robot": ("<html></html>", "neither URDF nor MJCF: its root element is <html>"),
    "xacro": ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>', "is a xacro file; run"),
    "xacro without a declaration": ("<robot><xacro:arm/></robot>", "is a xacro file; run"),
    "a number that is none": (mjcf(geom='type="sphere" size="nan"'), "nan size in geom"),
}


@pytest.mark.parametrize(("text", "sentence"), CASES.values(), ids=CASES)
def test_what_cannot_be_imported_is_told_in_one_sentence(tmp_path, monkeypatch, text, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MmpError) as error:
        imported(written(tmp_path, text))
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


FIN = (np.vstack([VERTICES, [[0.3, 0, 0]]]), np.vstack([FACES, [[0, 1, 8]]]))
MESHES = {
    "scale of 0": ((VERTICES, FACES, "1 0 1"), "scale [1, 0, 1]; no factor may be 0"),
    "flat": ((VERTICES * [1, 1, 0], FACES), "mesh"),
}


@pytest.mark.parametrize(("mesh", "sentence"), MESHES.values(), ids=MESHES)
def test_a_bad_mesh_is_told_in_one_sentence(tmp_path, mesh, sentence):
    with pytest.raises(MmpError) as error:
        imported(with_mesh(tmp_path / "arm.xml", *mesh))
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_a_mesh_file_of_another_unit_is_converted_to_metres(tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = trimesh.Trimesh(VERTICES, FACES)
    mesh.units = "0.0254 * meters"  # what trimesh says of COLLADA in inches
    monkeypatch.setattr(trimesh, "load", lambda *_, **__: mesh)
    vertices, _ = read_mesh(tmp_path / "box.dae")
    np.testing.assert_allclose(np.ptp(vertices, axis=0), np.array([0.1, 0.08, 0.06]) * 0.0254)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("box.step", "box.step cannot be read: its type '.step' is unknown; convert it to STL or OBJ"),
        ("box.ply", "box.ply is no valid .ply file; convert it to STL or OBJ"),
    ],
)
def test_a_mesh_file_that_cannot_be_read_is_told_without_a_python_class(tmp_path, name, sentence):
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    (tmp_path / name).write_text("junk")
    with pytest.raises(MmpError) as error:
        read_mesh(tmp_path / name)
    assert sentence in str(error.value)


BOX = mesh_samples.boxes()
WRONG = {
    "index beyond the vertices of glTF": (
        *("box.glb", struct.pack("<3I", 1, 5, 7), struct.pack("<3I", 1, 5, 851509253)),
        "has a triangle with vertex 851509253; its 8 vertices have the numbers 0 to 7",
    ),
    "index beyond 31 bits of glTF": (
        *("box.glb", struct.pack("<3I", 1, 5, 7), struct.pack("<3I", 1, 5, 2**32 - 1)),
        "has a triangle with vertex 4294967295",
    ),
    "vertex of glTF": ("box.glb", struct.pack("<f", 0.05), struct.pack("<f", math.nan), "a vertex that is not finite"),
    "vertex of PLY": ("box.ply", b"0.05", b"nan", "has a vertex that is not finite"),
    "vertex of OBJ": ("box.obj", b"v 0.05", b"v", "is no vertex; it must have three finite numbers"),
    "index 0 of OBJ": ("box.obj", b"f 1 2 4", b"f 0 2 4", "the numbers of its vertices must be 1 to 8, or -8 to -1"),
}


@pytest.mark.parametrize(("name", "old", "new", "sentence"), WRONG.values(), ids=WRONG)
def test_a_wrong_vertex_or_index_is_told_before_it_is_used(name, old, new, sentence):
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    assert old in BOX[name]
    with pytest.raises(MmpError, match=re.escape(sentence)):
        parse_mesh(Path(name), BOX[name].replace(old, new))


@pytest.mark.parametrize("name", BOX)
def test_a_box_in_each_format_has_its_vertices_and_triangles(tmp_path, name):
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    if name.endswith(".dae"):
        pytest.importorskip("collada", reason="pycollada is not installed")
    (tmp_path / name).write_bytes(BOX[name])
    vertices, faces = read_mesh(tmp_path / name)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.1, 0.08, 0.06], atol=1e-6)
    assert faces.shape == (12, 3)


def test_triangles_that_merging_makes_edges_are_left_out():
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    text = "OFF\n5 5 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 3 4 1\n"
    vertices, faces = parse_mesh(Path("a.off"), text.encode())
    assert (len(vertices), len(faces)) == (4, 4)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (b"-0.05", b"nan", "'nan' is no coordinate of a vertex"),
        (b"-0.05", b"x", "'x' is no coordinate of a vertex"),
        (b"<p>0", b"<p>4294967296", "'4294967296' is no index"),
        (b"<p>0", b"<p>x", "'x' is no index"),
        (b"</scene>", b"", "box.dae is no valid .dae file"),
    ],
)
def test_a_word_in_a_collada_file_is_told(old, new, sentence):
    assert old in BOX["box.dae"]
    with pytest.raises(MmpError, match=re.escape(sentence)):
        refuse_words(Path("box.dae"), BOX["box.dae"].replace(old, new, 1))
    refuse_words(Path("box.dae"), BOX["box.dae"])


@pytest.mark.parametrize("vertex", ["0", "4", "-4", "4294967297", "x", "1.5"])
def test_a_triangle_of_an_obj_file_has_vertices_of_the_file(vertex):
    content = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf {} 2/1 -1//1\n"
    refuse_words(Path("part.obj"), content.format("1").encode())
    with pytest.raises(
        MmpError, match=r"line 4: .* is no triangle; the numbers of its vertices must be 1 to 3, or -3 to -1"
    ):
        refuse_words(Path("part.obj"), content.format(vertex).encode())


def test_without_trimesh_a_mesh_file_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MmpError, match=r"needs trimesh: pip install 'mmp-env\[robots\]'"):
        read_mesh(tmp_path / "box.ply")


def test_a_mesh_file_whose_reader_is_missing_names_the_extra(tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")

    def missing(*_, **__):
        raise ImportError("missing `pip install pycollada`")

    monkeypatch.setattr(trimesh, "load", missing)
    with pytest.raises(MmpError, match=r"pip install 'mmp-env\[robots\]'; or convert them to STL or OBJ"):
        read_mesh(tmp_path / "box.dae")


FAULTS = {
    "inverted": ((VERTICES, FACES[:, ::-1]), "is inverted: its triangles point inwards"),
    "hole": ((VERTICES, FACES[1:]), "is not manifold"),
    "fin": (FIN, "is not manifold"),
}


@pytest.mark.parametrize(("mesh", "fault"), FAULTS.values(), ids=FAULTS)
def test_the_hull_of_an_open_or_inverted_mesh_stands_for_it_and_a_note_says_so(tmp_path, mesh, fault):
    chain = imported(with_mesh(tmp_path / "arm.xml", *mesh))
    (piece,), (note,) = pieces_and_notes(chain, chain.links[2])
    assert fault in note
    assert "Its convex hull stands for it" in note
    assert np.ptp(piece.vertices, axis=0).min() > 0.05


@pytest.mark.parametrize("scale", ["1 1 1", "0.001 0.001 0.001", "1 -1 1", "-1 -1 -1"])
def test_a_closed_mesh_of_any_scale_is_taken(tmp_path, scale):
    chain = imported(with_mesh(tmp_path / "arm.xml", VERTICES, FACES, scale))
    (piece,) = link_pieces(chain, chain.links[2])
    size = np.abs(np.array(scale.split(), float)) * [0.1, 0.08, 0.06]
    np.testing.assert_allclose(np.ptp(piece.vertices, axis=0), size, atol=3e-6)


def test_fingers_are_held_and_belong_to_the_last_link(tmp_path):
    chain = imported(written(tmp_path, mjcf(hand=fingers())))
    assert chain.joint_names == ("a1", "a2", "a3")
    assert chain.held == ("finger_joint0", "finger_joint1")
    assert [len(link.geoms) for link in chain.links] == [1, 1, 1, 3]


def test_the_tip_may_be_a_site_or_an_inner_body(tmp_path):
    path = written(tmp_path, mjcf())
    np.testing.assert_allclose(imported(path).flange[:3, 3], [0.1, 0, 0])
    np.testing.assert_allclose(imported(path, tip="attachment_site").flange[:3, 3], [0.1, 0, 0])
    inner = imported(path, tip="fore")
    assert inner.joint_names == ("a1", "a2")
    assert inner.held == ("a3",)


def test_a_root_inside_the_chain_cuts_off_the_joints_above(tmp_path):
    chain = imported(written(tmp_path, mjcf()), root="upper")
    assert chain.joint_names == ("a2", "a3")
    assert [link.name for link in chain.links] == ["upper", "fore", "hand"]


@pytest.mark.parametrize("option", ["root", "tip", "tool"])
def test_an_unknown_body_is_answered_with_the_nearest(tmp_path, option):
    with pytest.raises(MmpError, match="Did you mean 'hand'"):
        imported(written(tmp_path, mjcf()), **{option: "hamd"})


def test_a_prefix_chooses_one_arm_of_two(tmp_path):
    one = '<body name="{s}1" pos="0 {y} 0"><joint name="{s}_j1" range="-90 90"/><geom size="0.03"/>{tail}</body>'
    arms = "".join(
        one.format(s=s, y=y, tail=one.format(s=f"{s}_{s}", y=0, tail="")) for s, y in (("left", 0.3), ("right", -0.3))
    )
    path = written(
        tmp_path, f'<mujoco><worldbody><body name="torso"><geom size="0.1"/>{arms}</body></worldbody></mujoco>'
    )
    chain = imported(path, prefix="right_")
    assert chain.joint_names == ("j1", "right_j1")
    assert chain.held == ("left_j1", "left_left_j1")
    assert len(chain.links[0].geoms) == 3


def test_limits_that_look_like_degrees_are_noted(tmp_path):
    limit = '<limit lower="-90" upper="90" effort="20" velocity="1.2"/>'
    for text, noted in ((urdf(limit=limit), True), (urdf(), False)):
        notes = limits_of(imported(written(tmp_path, text))).notes
        assert any(note.endswith("these look like degrees: lift") for note in notes) == noted
