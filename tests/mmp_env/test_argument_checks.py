"""Wrong arguments of the Python API: one sentence says what is allowed."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from support.unchecked import unchecked

import mmp_env
from mmp_env import (
    Monitor,
    draw_instance,
    draw_problem,
    find_cell,
    load_cell,
    load_instances,
    load_plan,
    load_robot,
    load_tool,
    make_problem,
    place_arm,
    ring_cell,
    save_film,
    save_picture,
    save_plan,
)
from mmp_env.argument_checks import as_numbers, require_finite
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.files.instance_file import instances_from_dict
from mmp_env.model.margins import Margins
from mmp_planners import PlanResult, Status, make


@pytest.fixture(autouse=True)
def without_the_type_checker():
    with unchecked():
        yield


FLAG = "it must be True or False"
PIXELS = "it must be .*1 or more, and 4096 at most"
CELL = ring_cell(2)
TUCKED = {arm.name: arm.robot.tucked for arm in CELL.arms}
SOME = {"arm0": [0.0] * 6, "arm1": [0.0] * 6}


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("terminate_on_contact", "no", f"terminate_on_contact is 'no'; {FLAG}"),
        ("terminate_on_contact", None, f"terminate_on_contact is None; {FLAG}"),
        ("self_contacts", "no", f"self_contacts is 'no'; {FLAG}"),
        ("self_contacts", 0, f"self_contacts is 0; {FLAG}"),
        ("width", -3, f"width is -3; {PIXELS}"),
        ("width", "640", f"width is '640'; {PIXELS}"),
        ("width", 640.0, f"width is 640.0; {PIXELS}"),
        ("height", 5000, f"height is 5000; {PIXELS}"),
        ("height", True, f"height is True; {PIXELS}"),
        ("max_velocity", "1", "max_velocity of arm 'arm0' must be a positive number, or 6 of them"),
        ("max_velocity", True, "max_velocity of arm 'arm0' must be a positive number, or 6 of them"),
        ("max_velocity", None, "max_velocity of arm 'arm0' must be a positive number, or 6 of them"),
        ("control_rate_hz", "10", "control_rate_hz is '10'; it must be a finite number"),
        ("control_rate_hz", np.nan, "control_rate_hz is nan; it must be a finite number"),
        ("control_mode", 3, "control_mode is 3; it must be text"),
        ("control_mode", ["position"], "control_mode is .*; it must be text"),
        ("robot", 5, "robot is 5; it must be text"),
        ("spheres", 2.8, "spheres is 2.8; it must be the name of a sphere set"),
        ("task", 3, "task is 3; it must be a name"),
        ("cell", 3, "cell is 3; it must be a Cell, a file, or the name of a cell"),
    ],
)
def test_an_option_of_the_environment_is_checked_when_it_is_made(option, value, said):
    with pytest.raises(MmpError, match=said):
        gymnasium.make("MultiArmCell-2", **{option: value})


def test_options_may_be_numpy_scalars():
    env = gymnasium.make(
        "MultiArmCell-2",
        terminate_on_contact=np.False_,
        width=np.int64(64),
        max_velocity=np.float32(0.5),
        control_rate_hz=np.int64(50),
    )
    env.reset(seed=0)
    assert not env.step(np.zeros(12))[2]


def a_problem():
    return draw_problem(CELL, seed=3)


def a_plan():
    problem = a_problem()
    here = {arm: np.tile(q, (2, 1)) for arm, q in problem.start.items()}
    return mmp_env.Plan(problem=problem, times=np.array([0.0, 1.0]), positions=here)


def margins(obstacles):
    return Margins(arms=0.001, obstacles=obstacles, self=0.001)


def test_a_number_for_an_arm_is_the_velocity_limit_of_each_of_its_joints():
    problem = make_problem(CELL, TUCKED, TUCKED, max_velocity={"arm0": 0.5, "arm1": [0.25] * 6})
    assert (problem.max_velocity["arm0"].tolist(), problem.max_velocity["arm1"].tolist()) == ([0.5] * 6, [0.25] * 6)


def a_file():
    return instances_from_dict(
        {
            "schema": "mmp-instances/1",
            "cell": {"arms": [{"name": "a", "robot": "ur5e", "position": [0, 0, 0]}]},
            "instances": [{"name": "t0", "start": {"a": [0, -1.5, 0, 0, 0, 0]}, "goal": {"a": [1, -1.5, 0, 0, 0, 0]}}],
        },
        "some.json",
    )


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: draw_instance("ring-2"), "cell is 'ring-2'; it must be a Cell; find_cell gives"),
        (lambda: draw_problem(None), "cell is None; it must be a Cell"),
        (lambda: load_robot(None), "robot is None; it must be text"),
        (lambda: load_tool(5), "tool is 5; it must be text"),
        (lambda: place_arm(None, "ur5e", [0, 0, 0], [1, 0, 0, 0]), "name is None; it must be text"),
        (lambda: place_arm("a", None, [0, 0, 0], [1, 0, 0, 0]), "robot is None; it must be text"),
        (lambda: place_arm("a", "ur5e", [0, 0, 0], [1, 0, 0, 0], tool=0), "tool is 0; it must be text"),
        (lambda: save_picture(None, None), "there is no plan to show"),
        (lambda: save_picture(a_plan(), None), "path is None; it must be the path of a file"),
        (lambda: save_film(None, 5), "there is no plan to film"),
        (lambda: save_film(a_plan(), None), "path is None; it must be the path of a file"),
        (
            lambda: make_problem(CELL, TUCKED, TUCKED, max_velocity={"arm0": 1e-320, "arm1": 1.0}),
            r"max_velocity of arm 'arm0' is 1e-320; it must be 1e-09 \[rad/s\] at least",
        ),
        (lambda: draw_problem(CELL, seed="7"), "seed is '7'; it must be a whole number, 0 or more"),
        (lambda: make_problem("ring-2", SOME, SOME), "cell is 'ring-2'; it must be a Cell"),
        (lambda: make_problem(CELL, None, SOME), "start is None; it must be a mapping of arm"),
        (lambda: make_problem(CELL, SOME, [0.0] * 12), "goal is .*; it must be a mapping of arm"),
        (lambda: make_problem(CELL, SOME | {"arm1": ["0"] * 6}, SOME), "; it must be a list of joint angles"),
        (lambda: ring_cell(2.0), "count is 2.0; it must be one of the numbers 2, 4, 6, 8"),
        (lambda: ring_cell([2]), "count is .*; it must be one of the numbers 2, 4, 6, 8"),
        (lambda: find_cell(None), "cell is None; it must be a Cell, a file"),
        (lambda: save_picture(None, "a.png"), "there is no plan to show"),
        (lambda: save_film(None, "a.gif"), "there is no plan to film"),
        (lambda: save_plan(None, "a.json"), "there is no plan to save"),
        (lambda: Monitor(lag_rad="x"), "lag_rad is 'x'; it must be a finite number above 0"),
        (lambda: place_arm("a", "ur5e", "xyz", [1, 0, 0, 0]), "arm 'a' stands at nan.*three finite numbers"),
        (lambda: a_file().problem("t1"), "unknown instance 't1'. Did you mean 't0'"),
        (lambda: load_plan(None), "path is None; it must be the path of a file"),
        (lambda: load_cell(0), "path is 0; it must be the path of a file"),
        (lambda: load_instances(b"a.json"), "path is b'a.json'; it must be the path of a file"),
        (lambda: save_film(a_plan(), "a.gif", fps="x"), "fps is 'x'; it must be more than 0 and at most 60 frames"),
        (lambda: save_plan(a_plan(), None), "path is None; it must be the path of a file"),
        (lambda: make_problem(CELL, SOME, SOME, name=None), "name is None; it must be text"),
        (lambda: make_problem(CELL, TUCKED, TUCKED, name="a\nb"), r"name is 'a\\nb'; it must be names joined by '/'"),
        (lambda: make_problem(CELL, TUCKED, TUCKED, name="a//b"), "name is 'a//b'; it must be names joined by '/'"),
        (lambda: dataclasses.replace(a_problem(), margins=0.02), r"margins is 0\.02; it must be Margins\(arms=\.\.\."),
        (lambda: dataclasses.replace(a_problem(), margins=margins(-0.1)), "margin to obstacles is -0.1; it must be"),
        (lambda: dataclasses.replace(a_problem(), margins=margins(None)), "margin to obstacles is None; it must be"),
        (lambda: a_file().problem(0), "instance is 0; it must be an Instance of this file"),
    ],
)
def test_a_wrong_argument_is_refused_with_the_allowed_values(call, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MmpError, match=said) as caught:
        call()
    assert not isinstance(caught.value, InvalidInstanceError)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: make_problem(CELL, SOME, SOME, margins=0.02), "make_problem().*'margins'. Did you mean 'margin'"),
        (lambda: draw_problem(CELL, sed=3), "draw_problem().*'sed'. Did you mean 'seed'"),
        (lambda: save_film(None, "a.gif", fsp=3), "save_film().*'fsp'. Did you mean 'fps'"),
        *[
            (lambda name=name: make(name).plan(None, timelimit=1), "plan().*'timelimit'. Did you mean 'time_limit'")
            for name in ("auto", "ecbs", "prioritized", "rrt-connect")
        ],
    ],
)
def test_a_misspelt_keyword_is_answered_with_the_nearest_one(call, said):
    with pytest.raises(TypeError, match=f"^unknown argument of {said}") as caught:
        call()
    assert isinstance(caught.value, MmpError)


def test_a_planner_result_instead_of_a_plan_gets_a_hint_at_its_plan(tmp_path):
    result = PlanResult(status=Status.SOLVED)
    for write, name in ((save_picture, "a.png"), (save_film, "a.gif"), (save_plan, "a.json")):
        with pytest.raises(MmpError, match=r"is of type PlanResult; it must be a Plan; give the \.plan of"):
            write(result, tmp_path / name)
        with pytest.raises(MmpError, match="is of type str; it must be a Plan; load a plan file with load_plan"):
            write("plan.json", tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_an_environment_refuses_malformed_actions_and_monitors():
    env = gymnasium.make("MultiArmCell-2").unwrapped
    env.reset(seed=0)
    for action in ("up", None, ["0.1"] * 12, [[0.0], [0.0, 1.0]]):
        with pytest.raises(MmpError, match=r"the action (is .*; it must be 12 numbers|has shape)"):
            env.step(action)
    problem = env.get_wrapper_attr("problem")
    here = {arm: np.tile(q, (2, 1)) for arm, q in problem.start.items()}
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0, 1.0]), positions=here)
    with pytest.raises(MmpError, match="monitor is True; it must be a Monitor"):
        env.get_wrapper_attr("execute")(plan, monitor=True)


def test_an_instance_file_gives_the_problem_of_a_name():
    file = a_file()
    assert file.problem("t0").name == file.problem(file.instances[0]).name == "instances/t0"


def test_a_text_in_the_place_of_a_plan_is_no_json_object_but_may_be_a_path():
    def fault(plan):
        return str(mmp_env.check_plan(plan).violations[0])

    assert "the plan is of type str" in fault("plan.json")
    assert "load a plan file with load_plan" in fault("plan.json")
    assert "the plan is of type PlanResult" in fault(PlanResult(status=Status.TIMEOUT))
    assert "give the .plan of the planner's result" in fault(PlanResult(status=Status.TIMEOUT))
    assert "the plan is None; it must be a Plan, or the content of a plan.json" in fault(None)


@pytest.mark.parametrize(
    "value",
    [
        True,
        [True, 0.5],
        (0.5, np.True_),
        [[0.5], [False]],
        [np.array([True]), np.array([1.0])],
        np.array([0.5, True], object),
    ],
)
def test_truth_values_among_numbers_are_no_numbers(value):
    assert as_numbers(value) is None


@pytest.mark.parametrize("value", [np.ma.masked_all(2), [0.5, np.ma.masked], [np.zeros(2), np.ma.masked_all(2)]])
def test_masked_numbers_are_no_numbers(value):
    assert as_numbers(value) is None


def test_numbers_of_several_types_are_floats():
    for value in ([1, 0.5], (np.float32(1.0), 0.5), np.array([1, 0.5], object)):
        assert as_numbers(value).tolist() == [1.0, 0.5]


@pytest.mark.parametrize(
    ("value", "field"),
    [
        ({"a": [1, {"b": np.nan}]}, r"stats\.a\[1\]\.b is nan"),
        ([-np.inf], r"stats\[0\] is -inf"),
        (10**400, "stats is"),
    ],
)
def test_a_number_that_is_not_finite_is_named_with_its_field(value, field):
    with pytest.raises(MmpError, match=f"^{field}.*; it must be a finite number$"):
        require_finite(value, "stats")


def test_finite_numbers_and_other_values_are_taken():
    require_finite({"a": [1e308, True, None, "inf"], "b": 10**300}, "stats")
