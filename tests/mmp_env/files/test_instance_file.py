import json

import numpy as np
import pytest
from support import bad_files

from mmp_env.errors import InvalidInstanceError, MmpError, UnknownNameError
from mmp_env.files.instance_file import instances_from_dict, load_instances


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps(bad_files.good_instances()))
    return path


def test_a_file_has_its_cell_and_its_instances_in_order(path):
    file = load_instances(path)
    assert (file.name, file.cell.name) == ("pairs", "pair")
    assert [instance.name for instance in file.instances] == ["turn", "outside"]
    np.testing.assert_array_equal(file.instances[0].goal["right"].q, bad_files.TURNED)


def test_a_cell_without_a_name_has_that_of_the_instances():
    data = bad_files.spoilt(bad_files.good_instances(), ["cell", "name"], bad_files.GONE)
    assert instances_from_dict(data, "x.json").cell.name == "pairs"


def test_an_instance_becomes_a_problem_named_after_cell_and_instance(path):
    file = load_instances(path)
    problem = file.problem(file.instance("turn"), max_velocity=0.5, margin=0.001)
    assert problem.name == "pair/turn"
    assert problem.margin == 0.001
    np.testing.assert_array_equal(problem.start["left"], bad_files.TUCKED)
    np.testing.assert_array_equal(problem.max_velocity["left"], np.full(6, 0.5))


def test_an_invalid_instance_harms_no_other_and_is_named_when_it_is_asked_for(path):
    file = load_instances(path)
    with pytest.raises(InvalidInstanceError) as error:
        file.problem(file.instance("outside"))
    for word in [str(path), "instances[1]", "'outside'", "start of arm 'left'", "joint 3", "5.5", "3.14"]:
        assert word in str(error.value)


def test_an_unknown_instance_is_named_with_the_nearest(path):
    with pytest.raises(UnknownNameError, match=r"unknown instance 'tunr'\. Did you mean 'turn'\?"):
        load_instances(path).instance("tunr")


@pytest.mark.parametrize("case", bad_files.INSTANCES)
def test_a_bad_file_is_named_with_file_field_and_value(case):
    path, value, words = bad_files.INSTANCES[case]
    with pytest.raises(MmpError) as error:
        instances_from_dict(bad_files.spoilt(bad_files.good_instances(), path, value), "shop.json")
    for word in ["shop.json: ", *words]:
        assert word in str(error.value)


def test_a_published_cell_may_turn_an_arm_by_more_than_once_around():
    data = bad_files.spoilt(bad_files.good_instances(), ["cell", "arms", 0, "yaw"], 7.33)
    one_turn_less = bad_files.spoilt(bad_files.good_instances(), ["cell", "arms", 0, "yaw"], 7.33 - 2 * np.pi)
    poses = [instances_from_dict(each, "x.json").cell.arms[0].T_world_base for each in (data, one_turn_less)]
    np.testing.assert_allclose(*poses, atol=1e-12)
    with pytest.raises(MmpError, match=r"arms\[0\].yaw is 180.*degrees"):
        instances_from_dict(bad_files.spoilt(data, ["cell", "arms", 0, "yaw"], 180), "x.json")
