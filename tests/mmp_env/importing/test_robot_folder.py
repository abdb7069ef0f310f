"""Robot folders made from URDF and MJCF: a robot like a built-in one, whole or not at all, and its contract test."""

import json
import shutil

import mujoco
import numpy as np
import pytest
from reference.kinematics import link_frames
from support.small_arms import box_mesh, fingers, mjcf, urdf, with_mesh

from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.importing.chain_choice import ChainOptions
from mmp_env.importing.robot_check import check_robot
from mmp_env.importing.robot_folder import ImportOptions, add_robot, summary
from mmp_env.model.arm import place_arm
from mmp_env.model.lines import line_cell
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.robot_folders import robot_names

EXACT = "robot.json", "spheres.json", "hulls.json"


def add(source, out, name="small", cache=None, **chain):
    options = ImportOptions(name=name, chain=ChainOptions(**chain))
    made = add_robot(source, out, options, cache=cache, progress=lambda line: None)
    return made.folder, made.from_cache


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folders of robots: from URDF, from MJCF with fingers, from a mesh, and with a rail."""
    folder = tmp_path_factory.mktemp("robots")
    sources = {"from-urdf": ("a.urdf", urdf()), "from-mjcf": ("b.xml", mjcf(hand=fingers()))}
    sources["rail"] = ("c.xml", mjcf(joint2='type="slide" range="-0.1 0.4"'))
    for name, (file, text) in sources.items():
        (folder / file).write_text(text)
        add(folder / file, folder, name)
    add(with_mesh(folder / "d.xml", *box_mesh((0.06, 0.05, 0.04))), folder, "mesh")
    return folder


every_robot = pytest.mark.parametrize("name", ["from-urdf", "from-mjcf", "mesh", "rail"])


@every_robot
def test_an_imported_robot_passes_its_contract_test(made, name):
    report = check_robot(made / name)
    assert report.faults == []
    assert report.uncovered_mm == {"28": 0.0, "fine": 0.0}
    assert report.protrusion_mm["fine"] <= 5.0
    assert {"covers", "hulls", "kinematics", "self-collision pairs"} <= set(report.proved)


@every_robot
def test_an_imported_robot_has_the_kinematics_of_its_source(made, name):
    robot = load_robot(str(made / name))
    arm = place_arm("arm", str(made / name), [0, 0, 0], [1, 0, 0, 0])
    source = {"from-urdf": "a.urdf", "from-mjcf": "b.xml", "mesh": "d.xml", "rail": "c.xml"}[name]
    spec = mujoco.MjSpec.from_file(str(made / source))
    for mesh in list(spec.meshes):
        if mesh.file.endswith(".dae"):
            spec.delete(mesh)
    model = spec.compile()
    data = mujoco.MjData(model)
    for q in np.random.default_rng(0).uniform(robot.lower, robot.upper, (20, robot.dof)):
        data.qpos[: robot.dof] = q
        mujoco.mj_kinematics(model, data)
        for link, frame in list(zip(robot.link_names, link_frames(arm, q), strict=True))[1:]:
            np.testing.assert_allclose(data.body(link).xpos, frame[:3, 3], atol=1e-9)
            np.testing.assert_allclose(data.body(link).xmat.reshape(3, 3), frame[:3, :3], atol=1e-9)


def test_limits_come_from_the_source_or_are_stated_defaults(made):
    robot = load_robot(str(made / "from-urdf"))
    np.testing.assert_allclose(robot.velocity, [1.5, 1.2, 2.0])
    np.testing.assert_allclose(robot.effort[:2], [30, 20])
    np.testing.assert_allclose(robot.upper, [2, 1.5, 2 * np.pi])
    np.testing.assert_allclose(robot.draw_upper, [2, 1.5, np.pi])
    notes = " ".join(summary(made / "from-urdf")["notes"])
    assert "no velocity limits; the defaults are 2 rad/s and 0.5 m/s: roll" in notes
    assert "joints without limits turn by 6.283 rad to either side: roll" in notes


def test_the_summary_says_what_was_made(made):
    told = summary(made / "from-mjcf")
    assert (told["name"], told["joints"], told["links"], told["uncovered_mm"]) == ("from-mjcf", 3, 4, 0.0)
    assert told["held"] == ["finger_joint0", "finger_joint1"]
    assert set(told["spheres"]) == {"28", "fine"}
    assert {pair["reason"] for pair in told["self_pairs_ignored"]} <= {"adjacent", "always", "never"}
    assert {"a": "base", "b": "upper", "reason": "adjacent"} in told["self_pairs_ignored"]


def test_a_second_import_comes_from_the_cache_and_is_the_same(tmp_path):
    source = tmp_path / "arm.urdf"
    source.write_text(urdf())
    first, cached = add(source, tmp_path / "one", cache=tmp_path / "cache")
    assert not cached
    second, cached = add(source, tmp_path / "two", cache=tmp_path / "cache")
    assert cached
    for file in (*EXACT, "small.xml"):
        assert (first / file).read_bytes() == (second / file).read_bytes()
    source.write_text(urdf().replace('radius="0.05"', 'radius="0.06"'))
    assert not add(source, tmp_path / "two", cache=tmp_path / "cache")[1]


def test_a_source_that_fails_leaves_nothing_behind(tmp_path):
    source = tmp_path / "arm.urdf"
    source.write_text(urdf(limit=""))
    with pytest.raises(MmpError):
        add(source, tmp_path / "out", cache=tmp_path / "cache")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.urdf"]


def test_lengths_in_millimetres_are_refused_before_they_fill_the_memory(tmp_path):
    (tmp_path / "a.urdf").write_text(urdf(shape='<geometry><box size="50 50 300"/></geometry>'))
    sentence = "link 'upper' is 300 m long, and 20 m is the most; are its lengths in millimetres?"
    with pytest.raises(MmpError, match=sentence):
        add(tmp_path / "a.urdf", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.urdf"]


def test_a_folder_that_is_no_robot_is_not_replaced(tmp_path):
    source = tmp_path / "arm.urdf"
    source.write_text(urdf())
    (tmp_path / "small").mkdir()
    with pytest.raises(MmpError, match="is there already and is no robot"):
        add(source, tmp_path)


def test_a_robot_in_the_data_folder_is_found_by_its_name(made, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert "from-urdf" not in robot_names()
    shutil.copytree(made / "from-urdf", tmp_path / "mmp-env" / "robots" / "from-urdf")
    assert "from-urdf" in robot_names()
    assert load_robot("from-urdf").dof == 3


def test_a_cell_names_a_robot_by_its_path_from_the_cells_file(made):
    data = {"arms": [{"name": "a", "robot": "./from-urdf", "position": [0, 0, 0]}]}
    cell = cell_from_dict(data, str(made / "cell.json"))
    assert cell.arms[0].robot.name == "from-urdf"
    again = cell_from_dict(cell_to_dict(cell), "elsewhere/cell.json")
    assert cell_to_dict(again) == cell_to_dict(cell)


def test_a_path_without_a_robot_says_what_is_there(made):
    (made / "arm.urdf").write_text("<robot/>")
    with pytest.raises(MmpError, match=r"^robot '.*' has no robot\.json; docs/how-to/add-a-robot\.md"):
        load_robot(str(made))
    with pytest.raises(MmpError, match=r"arm\.urdf' is a file; `mmp robot add` makes a folder of it$"):
        load_robot(str(made / "arm.urdf"))
    with pytest.raises(MmpError, match="nowhere': there is no such folder"):
        load_robot(str(made / "nowhere"))
    with pytest.raises(MmpError, match=r"tool '.*nowhere': there is no such folder; docs/how-to/add-a-tool"):
        load_tool(str(made / "nowhere"))


def planted(folder, file, change, *, keep_fingerprints=False):
    """Changes a JSON file of a robot in place; without fingerprints the other tests have to find it."""
    path = folder / file
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    if not keep_fingerprints:
        robot = json.loads((folder / "robot.json").read_text())
        robot.pop("fingerprints", None)
        (folder / "robot.json").write_text(json.dumps(robot))


def shrink(data):
    data["fine"]["upper"][0][3] -= 0.004


def drop_spheres(data):
    del data["28"]["fore"]


def grow(data):
    data["fine"]["fore"][0][3] += 0.02


def move_hull(data):
    data["fore"][0]["vertices"][0][0] += 0.01


def shrink_hull(data):
    data["upper"][0]["radius"] -= 0.001


def lose_piece(data):
    data["fore"] = []


def test_more_pair(data):
    for pairs in data["self_collision_ignore"].values():
        pairs.append(["base", "hand"])


test_more_pair.__test__ = False


def wrong_reason(data):
    data["self_pairs_ignored"][0]["reason"] = "never"


def missing_pair(data):
    for pairs in data["self_collision_ignore"].values():
        pairs.remove(["base", "upper"])


def wrong_origin(data):
    data["joints"][1]["origin"]["xyz"][0] += 0.001


def wrong_axis(data):
    data["joints"][1]["axis"] = [0, 0, 1]


def wrong_limit(data):
    data["joints"][0]["upper"] += 0.1


def no_speed(data):
    data["joints"][0]["velocity"] = 0


def far_home(data):
    data["home"][0] = 10.0


FAULTS = {
    "smaller sphere": ("spheres.json", shrink, "uncovered"),
    "no spheres": ("spheres.json", drop_spheres, "has no spheres for 'fore'"),
    "larger sphere": ("spheres.json", grow, "protrudes"),
    "moved hull": ("hulls.json", move_hull, "piece 0 of 'fore'"),
    "smaller hull": ("hulls.json", shrink_hull, "piece 0 of 'upper' and its geom in the MJCF differ"),
    "lost piece": ("hulls.json", lose_piece, "1 geoms in the MJCF and 0 convex pieces"),
    "ignored pair": ("robot.json", test_more_pair, "base-hand"),
    "wrong reason": ("robot.json", wrong_reason, "is ignored as 'never', and is 'adjacent'"),
    "pair that is tested": ("robot.json", missing_pair, "base-upper"),
    "origin": ("robot.json", wrong_origin, "different poses"),
    "axis": ("robot.json", wrong_axis, "different poses"),
    "limit": ("robot.json", wrong_limit, "different joint limits"),
    "velocity": ("robot.json", no_speed, "has velocity 0"),
    "home": ("robot.json", far_home, "'home' is not within the limits"),
}


@pytest.mark.parametrize(("file", "change", "sentence"), FAULTS.values(), ids=FAULTS)
def test_a_planted_fault_is_found_without_fingerprints(made, tmp_path, file, change, sentence):
    folder = shutil.copytree(made / "from-mjcf", tmp_path / "from-mjcf")
    planted(folder, file, change)
    faults = check_robot(folder).faults
    assert any(sentence in fault for fault in faults), faults


def test_any_change_of_a_number_is_found_by_the_fingerprints(made, tmp_path):
    random = np.random.default_rng(0)
    for k in range(30):
        folder = shutil.copytree(made / "from-urdf", tmp_path / str(k) / "from-urdf")
        file = EXACT[k % 3]

        def change(data):
            places = list(numbers(data))
            owner, key = places[int(random.integers(len(places)))]
            owner[key] += float(random.choice([1e-3, -1e-3, 1e-5]))

        planted(folder, file, change, keep_fingerprints=True)
        assert f"{file} was changed after the import" in check_robot(folder).faults


def numbers(data):
    """The places of all numbers with a fraction, as owner and key."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        if isinstance(value, float):
            yield data, key
        elif isinstance(value, dict | list):
            yield from numbers(value)


def test_a_file_that_is_missing_or_broken_is_a_fault(made, tmp_path):
    folder = shutil.copytree(made / "from-urdf", tmp_path / "from-urdf")
    (folder / "hulls.json").unlink()
    assert any("hulls.json" in fault for fault in check_robot(folder).faults)
    (folder / "spheres.json").write_text("{")
    assert any("cannot be read" in fault for fault in check_robot(folder).faults)
    (folder / "spheres.json").unlink()
    assert any("spheres.json cannot be read" in fault for fault in check_robot(folder).faults)


def test_an_arm_that_hangs_from_its_base_stands_above_the_table_of_a_ring(tmp_path):
    text = mjcf().replace('size="0.06"', 'size="0.04"')
    standing, hanging = tmp_path / "standing.xml", tmp_path / "hanging.xml"
    standing.write_text(text)
    hanging.write_text(text.replace('pos="0 0 0.15"', 'pos="0 0 -0.15"').replace('pos="0 0 0.2"', 'pos="0 0 -0.2"'))
    for source, heights in ((standing, (0.0, 0.0)), (hanging, (0.4, 0.75))):
        folder, _ = add(source, tmp_path, source.stem)
        height = load_robot(str(folder)).ring_height
        assert heights[0] <= height <= heights[1]
        for cell in (ring_cell(2, str(folder), "exact"), line_cell(2, str(folder), "exact")):
            assert [arm.position[2] for arm in cell.arms] == [height] * 2
        told = any("hang below the base" in note for note in summary(folder)["notes"])
        assert told == (height > 0)
