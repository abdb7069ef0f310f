"""The checker's own reader of plans refuses everything that it does not understand."""

import numpy as np
import pytest
from support import tiny_plans

from mmp_env import check_plan
from mmp_env.check import fields
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.model import arm as arm_model
from mmp_env.model.arm import LARGEST_M
from mmp_env.model.margins import KINDS, LEAST_MARGIN_M


def broken(plan):
    """Returns the rules that a plan breaks. A report of an unreadable plan has no clearance."""
    report = check_plan(plan)
    assert report.min_clearance_m is None
    return {violation.rule for violation in report.violations}


def test_the_checker_and_the_reader_of_files_have_the_same_bounds():
    for name in ("SMALLEST_M", "LARGEST_M", "LARGEST_YAW_RAD"):
        assert getattr(fields, name) == getattr(arm_model, name)
    assert fields.LEAST_MARGIN_M == LEAST_MARGIN_M


def held_at(height):
    return {"shape": "sphere", "radius": 0.01, "position": [0.0, 0.0, height]}


UNREADABLE = {
    "another schema": lambda p: p.update(schema="mmp-plan/2"),
    "no problem": lambda p: p.pop("problem"),
    "no margin": lambda p: p["problem"].pop("margin"),
    "a margin of zero": lambda p: p["problem"].update(margin=0.0),
    "a margin below the rounding": lambda p: p["problem"].update(margin=1.9e-12),
    "margins below the rounding": lambda p: p["problem"].update(margins=dict.fromkeys(KINDS, 9e-13), margin=9e-13),
    "a margin that is true": lambda p: p["problem"].update(margin=True),
    "no maximal velocity": lambda p: p["problem"].pop("max_velocity"),
    "a missing arm": lambda p: p["positions"].pop("left"),
    "an arm too many": lambda p: p["positions"].update(middle=[]),
    "a string among the numbers": lambda p: p["positions"]["left"][1].__setitem__(2, "0.1"),
    "truth among the numbers": lambda p: p["positions"]["left"][1].__setitem__(2, False),
    "truth in a start": lambda p: p["problem"]["start"]["left"].__setitem__(0, True),
    "truth among the times": lambda p: p["times"].__setitem__(0, False),
    "a position of truth": lambda p: p["problem"]["cell"]["arms"][0]["position"].__setitem__(0, False),
    "truth among NumPy's numbers": lambda p: p.update(times=[np.False_, *p["times"][1:]]),
    "a time beyond all numbers": lambda p: p["times"].__setitem__(2, 10**400),
    "a margin beyond all numbers": lambda p: p["problem"].update(margin=10**5000),
    "a schema beyond all numbers": lambda p: p.update(schema=10**5000),
    "a sphere set beyond all numbers": lambda p: p["problem"]["cell"].update(spheres=10**5000),
    "a field named by a number": lambda p: p["problem"]["cell"].update({10**5000: 1}),
    "null among the numbers": lambda p: p["positions"]["left"][1].__setitem__(2, None),
    "an unknown field": lambda p: p.update(certificate={}),
    "an unknown robot": lambda p: p["problem"]["cell"]["arms"][0].update(robot="ur6e"),
    "an unknown tool": lambda p: p["problem"]["cell"]["arms"][0].update(tool="spoon"),
    "an unknown sphere set": lambda p: p["problem"]["cell"].update(spheres="30"),
    "something held": lambda p: p["problem"]["cell"]["arms"][0].update(held={"shape": "sphere", "radius": 0.1}),
    "a moving obstacle": lambda p: p["problem"]["cell"]["obstacles"][0].update(velocity=[1.0, 0.0, 0.0]),
    "an obstacle of negative size": lambda p: p["problem"]["cell"]["obstacles"][0].update(size=[1.0, -1.0, 1.0]),
    "a held object out of reach": lambda p: p["problem"]["cell"]["arms"][0].update(held=held_at(100.1)),
    "an obstacle named by half a character": lambda p: p["problem"]["cell"]["obstacles"][0].update(name="\ud800"),
    "an obstacle of no size": lambda p: p["problem"]["cell"]["obstacles"][0].update(size=[1.0, 1e-7, 1.0]),
    "an obstacle beyond the horizon": lambda p: p["problem"]["cell"]["obstacles"][0].update(position=[1e9, 0.0, 0.0]),
    "an unknown shape": lambda p: p["problem"]["cell"]["obstacles"][0].update(shape="cone"),
    "a zero quaternion": lambda p: p["problem"]["cell"]["obstacles"][0].update(quaternion=[0.0, 0.0, 0.0, 0.0]),
    "a yaw and a quaternion": lambda p: p["problem"]["cell"]["arms"][0].update(quaternion=[1.0, 0.0, 0.0, 0.0]),
    "a yaw in degrees": lambda p: p["problem"]["cell"]["arms"][1].update(yaw=180.0),
    "two arms of one name": lambda p: p["problem"]["cell"]["arms"][1].update(name="left"),
    "no arms": lambda p: p["problem"]["cell"].update(arms=[]),
}


@pytest.mark.parametrize("what", UNREADABLE)
def test_an_unreadable_value_breaks_the_schema(what):
    plan = tiny_plans.two_apart()
    UNREADABLE[what](plan)
    assert broken(plan) == {"schema"}


@pytest.mark.parametrize("data", [{}, {"schema": "mmp-plan/1", "problem": []}, {"schema": {}}])
def test_data_that_are_no_plan_break_the_schema(data):
    assert broken(data) == {"schema"}


MISSHAPEN = {
    "a joint too few": lambda p: [row.pop() for row in p["positions"]["left"]],
    "a joint too few once": lambda p: p["positions"]["left"][1].pop(),
    "a joint too many in the start": lambda p: p["problem"]["start"]["left"].append(0.0),
    "a sample too few": lambda p: p["positions"]["right"].pop(),
    "no samples": lambda p: p.update(times=[]),
    "times in a table": lambda p: p.update(times=[p["times"]]),
}


@pytest.mark.parametrize("what", MISSHAPEN)
def test_wrong_numbers_of_joints_or_samples_break_the_shape(what):
    plan = tiny_plans.two_apart()
    MISSHAPEN[what](plan)
    assert broken(plan) == {"shape"}


def everything_optional(plan):
    """Returns the same plan with every optional field spelled out as a null or a default."""
    cell = plan["problem"]["cell"]
    for arm in cell["arms"]:
        arm |= {"tool": "none", "quaternion": None, "held": None}
    for obstacle in cell["obstacles"]:
        obstacle |= {"yaw": None, "quaternion": [2.0, 0.0, 0.0, 0.0], "radius": None}
    cell["spheres"] = 28
    plan["problem"] |= {"max_acceleration": None, "max_jerk": None}
    return plan | {"velocities": None, "accelerations": None}


def test_optional_fields_with_defaults_change_nothing():
    plan = tiny_plans.two_apart()
    assert check_plan(everything_optional(plan)).as_dict() == check_plan(tiny_plans.two_apart()).as_dict()


def test_a_cell_that_does_not_name_its_spheres_is_checked_with_its_hulls():
    plan = tiny_plans.two_apart()
    plan["problem"]["cell"].pop("spheres")
    assert check_plan(plan).spheres == "exact"


@pytest.mark.parametrize("height", [LARGEST_M, 1.001 * LARGEST_M])
def test_planners_and_checker_take_a_held_object_within_the_same_distance(height):
    plan = tiny_plans.two_apart()
    plan["problem"]["cell"]["arms"][0]["held"] = held_at(height)
    taken = "schema" not in {violation.rule for violation in check_plan(plan).violations}
    assert taken == (height <= LARGEST_M)
    if taken:
        cell_from_dict(plan["problem"]["cell"], "cell")
    else:
        with pytest.raises(MmpError, match=r"held\.position"):
            cell_from_dict(plan["problem"]["cell"], "cell")


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_a_quaternion_may_have_any_length_but_zero(scale):
    plan = tiny_plans.two_apart()
    report = check_plan(plan)
    plan["problem"]["cell"]["arms"][0].update(yaw=None, quaternion=[scale, 0.0, 0.0, 0.0])
    assert check_plan(plan).as_dict() == report.as_dict()


def test_whole_numbers_that_are_longer_than_64_bits_are_numbers_too():
    plan = tiny_plans.two_apart()
    plan["problem"]["max_velocity"] = 10**20
    assert check_plan(plan).valid
    plan["times"] = np.array(plan["times"])
    plan["positions"] = {name: tuple(map(np.array, rows)) for name, rows in plan["positions"].items()}
    assert check_plan(plan).valid
