"""Bounds on tool axes: values, messages, problems, and files."""

import json
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from reference import kinematics
from support import tiny_plans, unchecked
from support.upright_problems import upright_problem

from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.files.instance_file import instances_from_dict
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.files.writing import json_text
from mmp_env.model.cell import Cell
from mmp_env.model.goals import PoseGoal
from mmp_env.model.keep import Upright, as_keep, keep_to_data
from mmp_env.model.plan import Plan
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem

ARMS = ("left", "right")
BOUND = {"upright": {"axis": [0.0, 0.0, 2.0], "within": 0.2}}


def test_bounds_read_and_written_are_the_same():
    keep = as_keep({"right": BOUND, "left": Upright(axis=[1.0, 0.0, 0.0], within=0.5)}, ARMS)
    assert list(keep) == ["left", "right"]
    assert keep["right"].direction.tolist() == [0.0, 0.0, 1.0]
    assert as_keep(keep_to_data(keep), ARMS) == keep
    assert keep_to_data(keep)["right"] == BOUND


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"middle": BOUND}, "keep: unknown arm 'middle'"),
        ({"left": {}}, "keep of arm 'left' is {}; it must be"),
        ({"left": {"upright": {"axis": [0, 0, 1]}}}, "keep of arm 'left' is"),
        ({"left": {"level": 3}}, "keep of arm 'left' is"),
        ({"left": {"upright": {"axis": [0.0, 0.0, 0.0], "within": 0.2}}}, "the axis of an upright tool is"),
        ({"left": {"upright": {"axis": [0.0, 1.0], "within": 0.2}}}, "3 finite numbers"),
        ({"left": {"upright": {"axis": [0.0, 1.0, float("nan")], "within": 0.2}}}, "3 finite numbers"),
        (
            {"left": {"upright": {"axis": [0.0, 0.0, 1.0], "within": 0.0}}},
            "the bound of an upright tool is 0.0; it must be",
        ),
        ({"left": {"upright": {"axis": [0.0, 0.0, 1.0], "within": 11.5}}}, "from 0.001 to 1.570796, a right angle"),
    ],
)
def test_a_wrong_bound_is_one_sentence(given, message):
    with pytest.raises(MmpError) as caught:
        as_keep(given, ARMS)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", [None, 3, "upright", [BOUND]])
def test_bounds_are_a_mapping(given):
    with unchecked.unchecked(), pytest.raises(MmpError, match="it must be an object of arm name"):
        as_keep(given, ARMS)


def test_a_problem_has_the_bounds_that_were_asked_for():
    problem = upright_problem(ring_cell(2), 0)
    assert set(problem.keep) == {"arm0", "arm1"}
    assert problem.keep is problem.cell.keep
    one = make_problem(replace(problem.cell, keep={}), problem.start, problem.goal, keep={"arm1": problem.keep["arm1"]})
    assert list(one.keep) == ["arm1"]
    assert make_problem(problem.cell, problem.start, problem.goal).keep == problem.keep
    assert make_problem(problem.cell, problem.start, problem.goal, keep={}).keep == {}


@pytest.mark.parametrize("which", ["start", "goal"])
def test_a_start_or_goal_that_breaks_its_bound_is_refused(which):
    problem = upright_problem(ring_cell(2), 0)
    q = getattr(problem, which)["arm1"]
    tilt = float(problem.cell.collision.tilt("arm1", q[None])[0])
    other = {"start": problem.goal, "goal": problem.start}[which]
    ends = {"start": other, "goal": other, which: getattr(problem, which)}
    bound = Upright(axis=problem.keep["arm1"].axis, within=tilt / 2)
    with pytest.raises(InvalidInstanceError) as caught:
        make_problem(ring_cell(2), **(ends | {"keep": {"arm1": bound}}))
    said = str(caught.value)
    assert "of arm 'arm1': its tool axis is" in said
    assert f"its bound is {tilt / 2:g} rad" in said


def test_the_slack_of_planners_fits_between_the_bound_and_the_start():
    problem = upright_problem(ring_cell(2), 0)
    tilt = max(
        float(problem.cell.collision.tilt("arm0", end["arm0"][None])[0]) for end in (problem.start, problem.goal)
    )
    tight = Upright(axis=problem.keep["arm0"].axis, within=tilt + 2e-4)
    near = make_problem(ring_cell(2), problem.start, problem.goal, keep={"arm0": tight})
    assert near.slack == pytest.approx(0.9 * 2e-4)


def test_a_free_configuration_keeps_the_bound():
    problem = upright_problem(ring_cell(2), 1)
    model, q = problem.cell.collision, problem.start["arm0"][None]
    assert model.is_free("arm0", q).all()
    narrow = replace(problem.cell, keep={"arm0": replace(problem.keep["arm0"], within=0.001)})
    assert not narrow.collision.is_free("arm0", q + 0.1 * np.eye(6)[3]).any()


def test_plan_files_keep_bounds_and_old_ones_have_none():
    problem = upright_problem(ring_cell(2), 0)
    still = {name: q[None] for name, q in problem.start.items()}
    plan = Plan(problem=replace(problem, goal=problem.start), times=np.zeros(1), positions=still)
    data = json.loads(json_text(plan_to_dict(plan)))
    assert data["problem"]["keep"]["arm0"] == {"upright": {"axis": [1.0, 0.0, 0.0], "within": 0.2}}
    assert plan_from_dict(data).problem.keep == problem.keep
    del data["problem"]["keep"]
    assert plan_from_dict(data).problem.keep == {}
    assert "keep" not in plan_to_dict(plan_from_dict(data))["problem"]
    data["problem"]["keep"] = {"arm7": BOUND}
    with pytest.raises(MmpError, match="keep: unknown arm 'arm7'"):
        plan_from_dict(data)


def test_instances_have_bounds():
    start = dict(tiny_plans.two_apart()["problem"]["start"])
    arms = tiny_plans.two_apart()["problem"]["cell"]["arms"]
    item = {"name": "one", "start": start, "goal": start}
    data = {"schema": "mmp-instances/1", "cell": {"arms": arms}, "instances": [item]}
    assert instances_from_dict(data, "file").instances[0].keep == {}
    name = arms[0]["name"]
    item["keep"] = {name: {"upright": {"axis": [0.0, 0.0, 1.0], "within": 1.5}}}
    file = instances_from_dict(data, "file")
    assert file.instances[0].keep == {name: Upright(axis=[0.0, 0.0, 1.0], within=1.5)}
    item["keep"] = {"nobody": {}}
    with pytest.raises(MmpError, match=r"instances\[0\].keep: unknown arm 'nobody'"):
        instances_from_dict(data, "file")


def flange_pose(arm, q):
    """Returns the pose of the flange as a goal."""
    frame, quaternion = kinematics.flange_frame(arm, q), np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame[:3, :3].ravel())
    return PoseGoal(position=frame[:3, 3], quaternion=quaternion)


def test_candidates_of_a_pose_keep_the_bound():
    problem = upright_problem(ring_cell(2), 4)
    arm, q = problem.cell.arms[0], problem.goal["arm0"]
    several = make_problem(problem.cell, problem.start, {"arm0": flange_pose(arm, q), "arm1": "stay"})
    assert len(several.goals["arm0"]) > 1
    assert (problem.cell.collision.tilt("arm0", several.goals["arm0"]) <= problem.keep["arm0"].within).all()
    tilted = flange_pose(arm, q + 0.6 * np.eye(6)[3])
    with pytest.raises(
        InvalidInstanceError, match=r"goal of arm 'arm0': its tool axis is 0.6\d+ rad from the world's z"
    ):
        make_problem(problem.cell, problem.start, {"arm0": tilted, "arm1": "stay"})


def test_a_cell_refuses_bounds_of_no_arm():
    with pytest.raises(MmpError, match="unknown arm 'arm5'"):
        replace(ring_cell(2), keep={"arm5": Upright(axis=[0.0, 0.0, 1.0], within=0.2)})
    assert isinstance(ring_cell(2), Cell)
