import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import bad_files

from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict, load_cell
from mmp_env.files.cell_source import find_cell
from mmp_env.model.rings import ring_cell
from mmp_env.robot_folders import robot_names

FINITE = st.floats(-50, 50, allow_subnormal=False)
LENGTH = st.floats(1e-6, 100)


def poses():
    yaw = st.fixed_dictionaries({"yaw": st.floats(-6.28, 6.28)})
    quaternion = st.lists(FINITE, min_size=4, max_size=4).filter(any).map(lambda q: {"quaternion": q})
    return st.tuples(st.lists(FINITE, min_size=3, max_size=3), st.one_of(st.just({}), yaw, quaternion)).map(
        lambda pair: {"position": pair[0], **pair[1]}
    )


def obstacles():
    size = st.lists(LENGTH, min_size=3, max_size=3)
    measures = st.one_of(
        st.fixed_dictionaries({"shape": st.just("box"), "size": size}),
        st.fixed_dictionaries({"shape": st.just("sphere"), "radius": LENGTH}),
        st.fixed_dictionaries({"shape": st.sampled_from(["cylinder", "capsule"]), "radius": LENGTH, "length": LENGTH}),
    )
    return st.lists(st.tuples(measures, poses()), max_size=3).map(
        lambda pairs: [{"name": f"thing{k}", **measure, **pose} for k, (measure, pose) in enumerate(pairs)]
    )


@settings(max_examples=50)
@given(robot=st.sampled_from(robot_names()), pose=poses(), things=obstacles(), spheres=st.sampled_from(["28", "fine"]))
def test_a_written_cell_reads_back_the_same_to_the_last_bit(robot, pose, things, spheres):
    data = {"arms": [{"name": "a", "robot": robot, **pose}], "obstacles": things, "spheres": spheres}
    written = cell_to_dict(cell_from_dict(data, "cell"))
    assert cell_to_dict(cell_from_dict(json.loads(json.dumps(written)), "cell")) == written


@pytest.mark.parametrize("robot", robot_names())
@pytest.mark.parametrize("count", [2, 8])
def test_the_default_cells_can_be_written_and_read(robot, count):
    cell = ring_cell(count, robot)
    again = cell_from_dict(cell_to_dict(cell), "ring")
    assert cell_to_dict(again) == cell_to_dict(cell)
    assert [arm.tool for arm in again.arms] == [arm.tool for arm in cell.arms]


def test_a_cell_has_the_poses_and_sizes_of_its_file(tmp_path):
    path = tmp_path / "pair.json"
    path.write_text(json.dumps(bad_files.good_cell()))
    cell = load_cell(path)
    assert cell.name == "pair"
    assert cell.spheres == "28"
    assert cell.arm_names == ("left", "right")
    np.testing.assert_allclose(cell.arm("left").T_world_base[:3, 3], [-0.6, 0, 0])
    np.testing.assert_allclose(cell.arm("right").quaternion, [0, 0, 0, 1])
    box, ball, post, rail = cell.obstacles
    np.testing.assert_allclose(box.size, [3, 3, 0.1])
    assert (ball.radius, ball.length) == (0.1, None)
    assert (post.radius, post.length) == (0.05, 0.4)
    np.testing.assert_allclose(rail.quaternion, [np.cos(0.25), 0, 0, np.sin(0.25)])


def test_yaml_and_json_say_the_same(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        """
        spheres: 28
        arms:
          - {name: left, robot: ur5e, position: [-0.6, 0, 0]}
          - name: right
            robot: panda
            position: [0.6, 0, 0]
            yaw: 3.14
        """
    )
    data = {
        "name": "mine",
        "spheres": "28",
        "arms": [
            {"name": "left", "robot": "ur5e", "position": [-0.6, 0, 0]},
            {"name": "right", "robot": "panda", "position": [0.6, 0, 0], "yaw": 3.14},
        ],
    }
    assert cell_to_dict(load_cell(path)) == cell_to_dict(cell_from_dict(data, "data"))


def test_the_cell_in_the_documents_can_be_read(tmp_path):
    page = Path(__file__).parents[3] / "docs" / "reference" / "files.md"
    path = tmp_path / "shop.yaml"
    path.write_text(page.read_text().partition("```yaml\n")[2].partition("```")[0])
    assert load_cell(path).arm_names == ("left", "right")


def test_a_file_that_does_not_say_has_exact_geometry_and_the_name_of_the_file(tmp_path):
    path = tmp_path / "my cell.json"
    path.write_text('{"arms": [{"name": "a", "robot": "fr5", "position": [0, 0, 0]}]}')
    cell = load_cell(path)
    assert (cell.name, cell.spheres, cell.obstacles) == ("my cell", "exact", ())


@pytest.mark.parametrize("stem", ["a" * 150, "two\nlines", "\x1b[31mred", "caf\udce9"])
def test_a_file_name_that_cannot_be_the_name_of_a_cell_is_refused_as_one(tmp_path, stem):
    path = tmp_path / f"{stem}.json"
    cell = bad_files.spoilt(bad_files.good_cell(), ["name"], bad_files.GONE)
    for data in (cell, bad_files.good_instances() | {"cell": cell, "name": None}):
        path.write_text(json.dumps(data))
        with pytest.raises(MmpError, match=r"name is missing, and the file's own name '.*' cannot stand in for it"):
            find_cell(path)
        path.write_text(json.dumps(data | {"name": "shop"}))
        assert find_cell(path).name == "shop"


@pytest.mark.parametrize(
    ("fields", "tool"), [({}, "franka-hand"), ({"tool": "franka-hand"}, "franka-hand"), ({"tool": None}, None)]
)
def test_a_panda_has_its_hand_unless_the_file_takes_it_off(fields, tool):
    cell = cell_from_dict({"arms": [{"name": "a", "robot": "panda", "position": [0, 0, 0], **fields}]}, "cell")
    mounted = cell.arm("a").tool
    assert (mounted.name if mounted else None) == tool
    assert cell_to_dict(cell)["arms"][0]["tool"] == tool


def test_the_word_none_takes_the_tool_off_too():
    cell = cell_from_dict({"arms": [{"name": "a", "robot": "panda", "position": [0, 0, 0], "tool": "none"}]}, "cell")
    assert cell.arm("a").tool is None


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 7.0, 1e200])
def test_a_quaternion_of_any_length_is_normalised(scale):
    data = {"name": "a", "robot": "ur5e", "position": [0, 0, 0], "quaternion": [0.6 * scale, 0, 0, 0.8 * scale]}
    np.testing.assert_allclose(cell_from_dict({"arms": [data]}, "cell").arm("a").quaternion, [0.6, 0, 0, 0.8])


@pytest.mark.parametrize("spheres", ["28", "fine"])
def test_neighbours_may_stand_as_close_as_published_shelves_have_them(spheres):
    arms = [{"name": f"a{k}", "robot": "panda", "position": [0.3 * k, 0, 0], "yaw": 1.57} for k in range(3)]
    assert len(cell_from_dict({"arms": arms, "spheres": spheres}, "cell").arms) == 3


@pytest.mark.parametrize("yaw", [6.2832, -6.2832])
def test_a_whole_turn_that_is_rounded_up_is_no_fault(yaw):
    data = {"name": "a", "robot": "ur5e", "position": [0, 0, 0], "yaw": yaw}
    np.testing.assert_allclose(cell_from_dict({"arms": [data]}, "cell").arm("a").quaternion, [-1, 0, 0, 0], atol=1e-5)


@pytest.mark.parametrize("case", bad_files.CELLS)
def test_a_bad_cell_is_named_with_file_field_and_value(case):
    path, value, words = bad_files.CELLS[case]
    with pytest.raises(MmpError) as error:
        cell_from_dict(bad_files.spoilt(bad_files.good_cell(), path, value), "shop.json")
    assert str(error.value).startswith("shop.json: ")
    for word in words:
        assert word in str(error.value)
    assert len(str(error.value)) < 500
