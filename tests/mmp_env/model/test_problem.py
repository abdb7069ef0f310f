"""Messages of `make_problem` about impossible starts and goals."""

import gymnasium
import pytest
from support import bad_files

from mmp_env import InvalidInstanceError, MmpError, make_problem
from mmp_env.files.cell_file import cell_from_dict


def with_joint(value, joint=1):
    """Returns the tucked configuration of both arms, with another value at one joint of `left`."""
    left = list(bad_files.TUCKED)
    left[joint] = value
    return {"left": left, "right": bad_files.TUCKED}


@pytest.fixture(scope="module")
def cell():
    return cell_from_dict(bad_files.good_cell(), "pair.json")


@pytest.mark.parametrize("which", ["start", "goal"])
def test_an_angle_in_degrees_is_called_so(cell, which):
    ends = {"start": with_joint(-2.2), "goal": with_joint(-2.2), which: with_joint(-70)}
    with pytest.raises(InvalidInstanceError) as error:
        make_problem(cell, **ends)
    for words in [f"{which} of arm 'left', joint 2", "-70.0000 rad", "allowed: -6.2832 to", "-70 looks like degrees"]:
        assert words in str(error.value)


def test_the_joint_that_shows_the_degrees_is_the_one_that_is_named(cell):
    configuration = with_joint(5.0, joint=2) | {"right": bad_files.TUCKED}
    configuration["left"][4] = -90.0  # joint 3 is slightly out of its limits too
    with pytest.raises(InvalidInstanceError, match=r"joint 5 .* -90 looks like degrees"):
        make_problem(cell, configuration, with_joint(-2.2))


@pytest.mark.parametrize("angle", [5.0, 9.0])
def test_an_angle_plausible_in_radians_has_no_hint_about_degrees(cell, angle):
    with pytest.raises(InvalidInstanceError, match=rf"joint 3 .*, is {angle:.4f} rad; allowed: -3\.1416 to 3\.1416$"):
        make_problem(cell, with_joint(angle, joint=2), with_joint(-2.2))


@pytest.mark.parametrize("right", ["tucked", bad_files.TUCKED], ids=["named", "given"])
@pytest.mark.parametrize("as_any", [False, True], ids=["alone", "any"])
def test_a_joint_beyond_all_numbers_is_named_whatever_the_other_arm_does(cell, right, as_any):
    far = with_joint(-1e300)["left"]
    with pytest.raises(InvalidInstanceError, match=r"joint 2 .* is -1e\+300 rad; allowed: -6\.2832"):
        make_problem(cell, with_joint(-2.2), {"left": {"any": [far, far]} if as_any else far, "right": right})


def test_out_of_limits_and_out_of_reach_together_are_one_sentence(cell):
    far = {"pose": {"position": [9.0, 0.0, 0.5], "free": "rotation"}}
    goal = {"left": {"any": [with_joint(-1e300)["left"], far]}, "right": "tucked"}
    with pytest.raises(InvalidInstanceError, match="none of the 2 poses can be reached within the joint limits"):
        make_problem(cell, with_joint(-2.2), goal)


def test_a_configuration_out_of_limits_is_left_out_where_there_are_others(cell):
    goal = {"left": {"any": [with_joint(-1e300)["left"], "tucked"]}, "right": "tucked"}
    assert make_problem(cell, with_joint(-2.2), goal).goal["left"].tolist() == pytest.approx(bad_files.TUCKED)


@pytest.mark.parametrize("number", [10**400, -(10**5000)], ids=["400 digits", "5000 digits"])
def test_a_whole_number_beyond_all_floats_is_refused(cell, number):
    good = with_joint(-2.2)
    with pytest.raises(MmpError, match=r"start of arm 'left' is .*; it must be a list of joint angles"):
        make_problem(cell, with_joint(number), good)
    with pytest.raises(MmpError, match="max_velocity of arm 'left'"):
        make_problem(cell, good, good, max_velocity={"left": [number] * 6, "right": [1] * 6})


@pytest.mark.parametrize("velocity", [45, 12.6, 1e9, {"left": [1.0] * 6, "right": [1, 1, 45, 1, 1, 1]}])
def test_a_velocity_in_degrees_per_second_is_refused(cell, velocity):
    good = with_joint(-2.2)
    said = r"max_velocity of arm '(left|right)', joint [13] \(.*\), is .* rad/s; the robot's own limit is .* degrees"
    with pytest.raises(MmpError, match=said):
        make_problem(cell, good, good, max_velocity=velocity)
    if not isinstance(velocity, dict):
        with pytest.raises(MmpError, match=said.replace("(left|right)", "arm0")):
            gymnasium.make("MultiArmCell-2", max_velocity=velocity)


def test_a_plausible_velocity_above_the_robots_own_is_that_of_the_robot(cell):
    good = with_joint(-2.2)
    problem = make_problem(cell, good, good, max_velocity=12.5)
    assert (problem.max_velocity["left"] == cell.arm("left").robot.velocity).all()
