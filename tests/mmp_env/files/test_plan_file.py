import dataclasses
import json
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from support import bad_files

from mmp_env import check_plan
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import load_cell
from mmp_env.files.plan_file import load_plan, plan_from_dict, plan_to_check, plan_to_dict, save_plan
from mmp_env.files.writing import json_text, plain
from mmp_env.model.margins import KINDS, Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem, velocity_limits
from mmp_env.model.rings import ring_cell

CELL = ring_cell(2)


def random_plan(times, positions, **more):
    start, goal = ({name: q[k] for name, q in positions.items()} for k in (0, -1))
    problem = Problem(
        cell=CELL,
        start=start,
        goal=goal,
        max_velocity=velocity_limits(CELL, 0.8),
        margins=Margins(arms=0.0017, obstacles=0.0013, self=0.0009),
        name="ring-2/7",
    )
    return Plan(problem=problem, times=times, positions=positions, **more)


@settings(max_examples=25)
@given(st.data(), st.integers(1, 5))
def test_a_written_plan_reads_back_the_same_to_the_last_bit(data, count):
    times = data.draw(st_numpy.arrays(float, count, elements=st.floats(0, 1e6)))
    rows = st_numpy.arrays(float, (count, 6), elements=st.floats(-10, 10))
    plan = random_plan(times, {"arm0": data.draw(rows), "arm1": data.draw(rows)}, planner={"name": "x", "seed": 3})
    text = json_text(plan_to_dict(plan))
    again = plan_from_dict(json.loads(text))
    assert json_text(plan_to_dict(again)) == text
    np.testing.assert_array_equal(again.times, times)
    np.testing.assert_array_equal(again.positions["arm1"], plan.positions["arm1"])


def test_a_plan_is_the_same_bytes_however_its_arms_were_finished(tmp_path):
    rows = np.linspace(0, 1, 12).reshape(2, 6)
    one, other = (dict.fromkeys(names, rows) for names in (["arm0", "arm1"], ["arm1", "arm0"]))
    for name, positions in (("one", one), ("other", other)):
        save_plan(random_plan(np.array([0.0, 1.0]), positions), tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_a_plan_file_stands_on_its_own(tmp_path):
    rows = np.linspace(0, 1, 12).reshape(2, 6)
    stats = {"expanded_nodes": np.int64(3), "deadline_hit": np.False_, "ratio": np.inf}
    plan = random_plan(
        np.array([0.0, 1.0]), {"arm0": rows, "arm1": rows}, planner={"name": "x", "options": {"w": 1.5}}, stats=stats
    )
    save_plan(plan, tmp_path / "plan.json")
    data = json.loads((tmp_path / "plan.json").read_text())
    assert list(data) == ["schema", "problem", "times", "positions", "planner", "stats"]
    assert data["schema"] == "mmp-plan/1"
    assert data["problem"]["cell"]["spheres"] == "28"
    assert data["problem"]["cell"]["arms"][0].keys() == {"name", "robot", "tool", "position", "quaternion"}
    assert data["problem"]["max_velocity"]["arm0"] == [0.8] * 6
    assert data["problem"]["margin"] == 0.0017
    assert data["problem"]["margins"] == {"arms": 0.0017, "obstacles": 0.0013, "self": 0.0009}
    assert data["planner"] == {"name": "x", "options": {"w": 1.5}}
    assert data["stats"] == {"expanded_nodes": 3, "deadline_hit": False, "ratio": None}


@pytest.mark.parametrize(
    ("times", "last", "said"), [([0.0, np.inf], 1.0, "times"), ([0.0, 1.0], np.nan, "positions of arm 'arm1'")]
)
def test_a_plan_that_could_not_be_read_back_is_not_saved(tmp_path, times, last, said):
    rows = np.linspace(0, 1, 12).reshape(2, 6)
    plan = random_plan(np.array(times), {"arm0": rows, "arm1": np.append(rows[:, :5], [[0.0], [last]], axis=1)})
    with pytest.raises(MmpError, match=f"cannot be saved: its {said} hold a number that is not finite"):
        save_plan(plan, tmp_path / "plan.json")
    assert not list(tmp_path.iterdir())


def test_the_name_of_a_problem_in_a_file_is_that_of_an_instance():
    data = bad_files.good_plan()
    for name in ("two\nlines", "a//b", "x" * 251):
        data["problem"]["name"] = name
        with pytest.raises(MmpError, match=r"^plan: problem\.name is .*; it must be names joined by '/'"):
            plan_from_dict(data)


def test_every_configuration_has_a_line_of_its_own():
    rows = np.linspace(0, 1, 60).reshape(10, 6) + 1 / 3
    text = json_text(plan_to_dict(random_plan(np.arange(10.0), {"arm0": rows, "arm1": rows})))
    for row in rows:
        assert sum(json.dumps(row.tolist()) in line for line in text.splitlines()[20:]) >= 2


def test_a_plan_that_is_wrong_still_loads_with_its_own_margin(tmp_path):
    data = bad_files.good_plan()
    data["times"][1] = -1.0
    data["positions"]["left"][1][0] = 99.0
    data["problem"]["start"]["left"][0] = 50.0
    data["problem"] |= {"margin": 0.5, "margins": {"arms": 0.5, "obstacles": 0.5, "self": 0.5}}
    (tmp_path / "plan.json").write_text(json.dumps(data))
    plan = load_plan(tmp_path / "plan.json")
    assert plan.problem.margin == 0.5
    assert plan.times[1] == -1.0
    assert plan.problem.start["left"][0] == 50.0


@pytest.mark.parametrize(
    ("margins", "said"),
    [
        ({"margin": 1.9e-12}, "problem.margin is 1.9e-12; it must be a positive number [m], 2e-12 at least and 200"),
        ({"margin": 1e-320, "margins": dict.fromkeys(KINDS, 1e-320)}, "problem.margin is 1e-320"),
        ({"margin": 201.0}, "problem.margin is 201"),
        ({"margin": 101.0, "margins": dict.fromkeys(KINDS, 101.0)}, "problem.margin is 101"),
        ({"margin": 0.1, "margins": {"arms": 0.1, "obstacles": 0.1, "self": 9e-13}}, "problem.margins.self is 9e-13"),
    ],
)
def test_a_margin_out_of_bounds_is_refused(margins, said):
    data = bad_files.good_plan()
    data["problem"].pop("margins", None)
    data["problem"] |= margins
    with pytest.raises(MmpError, match=re.escape(said)):
        plan_from_dict(data)


def test_the_robots_own_speed_limit_holds_as_well():
    data = bad_files.good_plan()
    data["problem"]["max_velocity"] = {"left": [100.0] * 6, "right": [0.1] * 6}
    limits = plan_from_dict(data).problem.max_velocity
    assert (limits["left"] < 4).all()
    assert (limits["right"] == 0.1).all()


def test_a_retimed_plan_keeps_its_rates_and_their_limits():
    data = bad_files.good_plan()
    rates = {name: (0.5 * np.array(rows)).tolist() for name, rows in data["positions"].items()}
    data |= {"velocities": rates, "accelerations": rates}
    data["problem"] |= {"max_acceleration": 8.0, "max_jerk": {"left": [1.0] * 6, "right": [1.0] * 6}}
    written = plan_to_dict(plan_from_dict(data))
    assert written["velocities"] == written["accelerations"] == rates
    assert written["problem"]["max_acceleration"] == {"left": [8.0] * 6, "right": [8.0] * 6}
    assert written["problem"]["max_jerk"] == data["problem"]["max_jerk"]


@pytest.mark.parametrize("case", bad_files.PLANS)
def test_a_bad_file_is_named_with_file_field_and_value(case):
    path, value, words = bad_files.PLANS[case]
    with pytest.raises(MmpError) as error:
        plan_from_dict(bad_files.spoilt(bad_files.good_plan(), path, value), "shop.json")
    for word in ["shop.json: ", *words]:
        assert word in str(error.value)


def test_a_plan_that_lacks_an_arm_is_neither_written_nor_valid(tmp_path):
    plan = random_plan(np.array([0.0, 1.0]), {"arm0": np.zeros((2, 6)), "arm1": np.zeros((2, 6))})
    lacking = dataclasses.replace(plan, positions={"arm0": plan.positions["arm0"]})
    with pytest.raises(MmpError, match="numbers for the arms arm0; a file needs them for arm0, arm1"):
        save_plan(lacking, tmp_path / "plan.json")
    assert not list(tmp_path.iterdir())
    (violation,) = check_plan(lacking).violations
    assert violation.rule == "schema"
    assert "arm1" in violation.message


@pytest.mark.parametrize(
    ("limit", "words"),
    [("MAX_PLAN_BYTES", "0 MB is the most"), ("MOST_PLAN_COLLECTIONS", "; 40 is the most")],
)
def test_a_plan_that_no_command_could_read_is_not_written(tmp_path, monkeypatch, limit, words):
    monkeypatch.setattr(f"mmp_env.files.plan_file.{limit}", 50)
    monkeypatch.setattr("mmp_env.files.plan_file._OTHER_LISTS", 10)
    rows = np.zeros((40, 6))
    plan = random_plan(np.arange(40.0), {"arm0": rows, "arm1": rows})
    with pytest.raises(MmpError, match=f"{words} that is read$"):
        save_plan(plan, tmp_path / "plan.json")
    with pytest.raises(MmpError, match=rf"{words} that is read; retime it with a lower rate \(--rate\), or not at all"):
        save_plan(dataclasses.replace(plan, velocities=plan.positions), tmp_path / "plan.json")
    assert not (tmp_path / "plan.json").exists()


def test_a_plan_may_be_larger_than_other_files(tmp_path, monkeypatch):
    path, rows = tmp_path / "plan.json", np.zeros((40, 6))
    save_plan(random_plan(np.arange(40.0), {"arm0": rows, "arm1": rows}), path)
    monkeypatch.setattr("mmp_env.files.reading.MAX_JSON_BYTES", 500)
    monkeypatch.setattr("mmp_env.files.reading.MOST_COLLECTIONS", 5)
    assert len(load_plan(path).times) == 40
    with pytest.raises(MmpError, match="load_cell takes a cell file"):
        load_cell(path)
    data = json.loads(path.read_text())
    for other in (data | {"schema": "mmp-episode/1"}, {"times": data.pop("times")} | data):
        path.write_text(json.dumps(other))
        with pytest.raises(MmpError, match=r"plan\.json is larger than"):
            load_plan(path)


@pytest.mark.parametrize("limit", ["MAX_PLAN_BYTES", "MOST_PLAN_COLLECTIONS"])
def test_a_plan_has_limits_too(tmp_path, monkeypatch, limit):
    path, rows = tmp_path / "plan.json", np.zeros((40, 6))
    save_plan(random_plan(np.arange(40.0), {"arm0": rows, "arm1": rows}), path)
    monkeypatch.setattr(f"mmp_env.files.reading.{limit}", 50)
    with pytest.raises(MmpError, match=r"the most that (is|are) read"):
        load_plan(path)


@pytest.mark.parametrize("key", ["nothing", "positions", "times"])
def test_the_checker_sees_the_content_of_the_file(key):
    rows = np.linspace(0, 1, 12).reshape(2, 6)
    plan = random_plan(np.array([0.0, 1.0]), {"arm0": rows, "arm1": -rows})
    if key == "times":
        plan = dataclasses.replace(plan, times=np.array([0.0, np.nan]))
    if key == "positions":
        plan = dataclasses.replace(plan, positions={"arm0": rows, "arm1": np.nan * rows})
    assert plain(plan_to_check(plan)) == plan_to_dict(plan)
    assert str(check_plan(plan)) == str(check_plan(plan_to_dict(plan)))
