"""Export: formats by suffix, one file per arm, several plans in a row, and complete files or none."""

import csv
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from support import tiny_plans
from support.unchecked import unchecked

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.export import export_plan
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.model.robot_reading import load_robot
from mmp_planners import PlanResult, Status


@pytest.fixture
def plan():
    return plan_from_dict(tiny_plans.two_apart())


@pytest.fixture
def retimed(plan):
    rng = np.random.default_rng(0)
    derivatives = {
        key: {arm: rng.normal(size=q.shape) for arm, q in plan.positions.items()}
        for key in ("velocities", "accelerations")
    }
    return replace(plan, **derivatives)


def back(plan):
    """Returns the reversed plan, which begins where `plan` ends."""
    problem = replace(plan.problem, start=plan.problem.goal, goal=plan.problem.start)
    return replace(plan, problem=problem, positions={arm: q[::-1] for arm, q in plan.positions.items()})


def table(path):
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=float)


def test_a_csv_has_a_row_for_each_time_and_reads_back_exactly(plan, tmp_path):
    export_plan(plan, tmp_path / "plan.csv")
    header, rows = table(tmp_path / "plan.csv")
    assert header == ["time", *(f"{arm}/joint{k}" for arm in ("left", "right") for k in range(1, 7))]
    np.testing.assert_array_equal(rows[:, 0], plan.times)
    np.testing.assert_array_equal(rows[:, 1:7], plan.positions["left"])
    np.testing.assert_array_equal(rows[:, 7:], plan.positions["right"])


def test_a_csv_of_a_retimed_plan_has_velocities_and_accelerations_behind(retimed, tmp_path):
    export_plan(retimed, tmp_path / "plan.csv")
    header, rows = table(tmp_path / "plan.csv")
    assert header[13] == "left/joint1/velocity"
    assert header[-1] == "right/joint6/acceleration"
    np.testing.assert_array_equal(rows[:, 13:19], retimed.velocities["left"])
    np.testing.assert_array_equal(rows[:, -6:], retimed.accelerations["right"])


def test_an_npz_has_the_arrays_of_each_arm(plan, retimed, tmp_path):
    export_plan(plan, tmp_path / "plan.npz")
    export_plan(retimed, tmp_path / "retimed.npz")
    plain, full = (np.load(tmp_path / f"{name}.npz") for name in ("plan", "retimed"))
    assert plain["arms"].tolist() == ["left", "right"]
    assert plain["left/joints"].tolist() == [f"left/joint{k}" for k in range(1, 7)]
    np.testing.assert_array_equal(plain["times"], plan.times)
    np.testing.assert_array_equal(plain["right/positions"], plan.positions["right"])
    assert "left/velocities" not in plain
    np.testing.assert_array_equal(full["left/velocities"], retimed.velocities["left"])
    np.testing.assert_array_equal(full["right/accelerations"], retimed.accelerations["right"])


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".yaml", ".xml"])
def test_the_same_plan_gives_the_same_bytes(retimed, tmp_path, suffix):
    for name in ("one", "two"):
        export_plan(retimed, tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_with_arm_in_the_name_each_arm_has_a_file(plan, tmp_path):
    written = export_plan(plan, tmp_path / "of-{arm}.csv", joint_names="{vendor}")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["of-left.csv", "of-right.csv"]
    assert [path.name for path in written] == ["of-left.csv", "of-right.csv"]
    header, rows = table(tmp_path / "of-right.csv")
    assert header[:3] == ["time", "shoulder_pan_joint", "shoulder_lift_joint"]
    np.testing.assert_array_equal(rows[:, 1:], plan.positions["right"])


def test_plans_in_a_row_are_one_motion_with_one_row_where_they_meet(plan, tmp_path):
    export_plan([plan, back(plan)], tmp_path / "both.csv")
    _, rows = table(tmp_path / "both.csv")
    count = len(plan.times)
    assert len(rows) == 2 * count - 1
    assert (np.diff(rows[:, 0]) > 0).all()
    assert rows[-1, 0] == pytest.approx(2 * plan.makespan_s)
    np.testing.assert_array_equal(rows[count:, 1:7], plan.positions["left"][::-1][1:])


def panda(arm):
    """Returns an arm of the same name with one more joint."""
    return replace(arm, robot=load_robot("panda"))


def test_plans_that_do_not_fit_together_are_refused(plan, retimed, tmp_path):
    with pytest.raises(MmpError, match=r"plan 1 does not go on from plan 0: arm 'left' begins 0\.\d+ rad from where"):
        export_plan([plan, plan], tmp_path / "both.csv")
    with pytest.raises(MmpError, match="plan 1 does not go on from plan 0: only one of them has velocities"):
        export_plan([retimed, back(plan)], tmp_path / "both.csv")
    cell = plan.problem.cell
    fewer = replace(plan, problem=replace(plan.problem, cell=replace(cell, arms=cell.arms[:1])))
    other = replace(plan, problem=replace(plan.problem, cell=replace(cell, arms=(cell.arms[0], panda(cell.arms[1])))))
    for stranger in (fewer, other):
        with pytest.raises(MmpError, match="plan 1 does not go on from plan 0: its arms are others"):
            export_plan([plan, stranger], tmp_path / "both.csv")
    assert list(tmp_path.iterdir()) == []


def test_no_plan_and_a_plan_without_one_of_its_arms_are_refused(plan, tmp_path):
    lacking = replace(plan, positions={"left": plan.positions["left"]})
    with pytest.raises(MmpError, match="there is no plan to export"):
        export_plan([], tmp_path / "plan.csv")
    with pytest.raises(MmpError, match="does not say where arm 'right' of its cell is"):
        export_plan([plan, lacking], tmp_path / "plan.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (None, "there is no plan to export; the status of the planner's result says why"),
        ("plan.json", "the plan to export is of type str; it must be a Plan; load a plan file with load_plan"),
        (PlanResult(status=Status.TIMEOUT), "is of type PlanResult; .* give the .plan of the planner's result"),
        ([None], "there is no plan to export"),
        ({"schema": "mmp-plan/1"}, "the plan to export is of type dict; it must be a Plan"),
    ],
)
def test_other_objects_than_plans_are_refused_in_one_sentence(tmp_path, given, message):
    with unchecked(), pytest.raises(MmpError, match=message):
        export_plan(given, tmp_path / "plan.csv")
    assert not list(tmp_path.iterdir())


def test_a_path_or_pattern_that_is_no_text_is_refused_in_one_sentence(plan, tmp_path):
    with unchecked(), pytest.raises(MmpError, match="path is None; it must be the path of a file"):
        export_plan(plan, None)
    with unchecked(), pytest.raises(MmpError, match="joint_names is None; it must be text"):
        export_plan(plan, tmp_path / "plan.csv", joint_names=None)
    assert not list(tmp_path.iterdir())


def test_the_exported_motion_prints_as_one_line(plan, tmp_path):
    (motion,) = export_plan(plan, tmp_path / "plan.csv").values()
    assert repr(motion) == f"<Motion of 12 joints: 3 samples, {plan.makespan_s:.2f} s>"
    assert repr(motion.arms["left"]) == "<ArmMotion of 6 joints: 3 samples>"


@pytest.mark.parametrize(
    ("pattern", "name"),
    [
        ("{arm}/{joint}", "right/joint2"),
        ("{arm}_{joint}", "right_joint2"),
        ("{arm}_{vendor}", "right_shoulder_lift_joint"),
        ("{robot}_{arm}_{number}", "ur5e_right_2"),
    ],
)
def test_joints_are_named_by_the_pattern(plan, tmp_path, pattern, name):
    export_plan(plan, tmp_path / "plan.csv", joint_names=pattern)
    assert table(tmp_path / "plan.csv")[0][8] == name


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("plan.cvs", {}, r"unknown export format '\.cvs'\. Did you mean '\.csv'\? Known: \.csv, \.npz, \.xml, \.yaml"),
        ("plan", {}, r"does not say in which format; the name must end in \.csv"),
        (".csv", {}, r"does not say in which format; .* as plan\.csv does"),
        ("a" * 300 + ".csv", {}, "cannot be found: File name too long"),
        ("plan.csv", {"joint_names": "{arm}\n{joint}"}, "characters that do not print"),
        ("plan.csv", {"joint_names": "\udcff{arm}{joint}"}, "characters that do not print"),
        ("{arn}.csv", {}, r"unknown placeholder of file names 'arn'\. Did you mean 'arm'"),
        ("{arm}.xml", {}, r"the MJCF is of the whole cell; leave \{arm\} out"),
        ("plan.csv", {"joint_names": "{arm}_{vender}"}, r"unknown placeholder of joint names 'vender'.*'vendor'"),
        ("plan.csv", {"joint_names": "{joint}"}, r"call 2 joints 'joint1'; \{arm\} and \{joint\} tell them apart"),
        ("nowhere/plan.csv", {}, "cannot be written: No such file or directory"),
    ],
)
def test_impossible_exports_are_one_sentence_and_leave_no_file(plan, tmp_path, name, options, message):
    with pytest.raises(MmpError, match=message):
        export_plan(plan, tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_where_one_of_several_files_cannot_be_written_none_is(plan, tmp_path):
    (tmp_path / "right.csv").mkdir()
    with pytest.raises(MmpError, match="not a regular file"):
        export_plan(plan, tmp_path / "{arm}.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["right.csv"]


def test_an_unknown_format_is_an_unknown_name(plan, tmp_path):
    with pytest.raises(UnknownNameError) as caught:
        export_plan(plan, tmp_path / "plan.ymal")
    assert "Did you mean '.yaml'?" in str(caught.value)


def renamed(name):
    """Returns the plan, its left arm under another name."""
    data = tiny_plans.two_apart()
    data["problem"]["cell"]["arms"][0]["name"] = name
    for rows in (data["positions"], data["problem"]["start"], data["problem"]["goal"]):
        rows[name] = rows.pop("left")
    return plan_from_dict(data)


@pytest.mark.parametrize("name", ["..", ".", "a\\b"])
def test_the_name_of_an_arm_leads_to_no_other_folder(tmp_path, name):
    (tmp_path / "out" / "in").mkdir(parents=True)
    written = export_plan(renamed(name), tmp_path / "out" / "in" / "{arm}.csv")
    assert {path.parent for path in written} == {tmp_path / "out" / "in"}
    with pytest.raises(MmpError, match="cannot be written: No such file or directory"):
        export_plan(renamed(name), tmp_path / "out" / "in" / "{arm}" / "plan.csv")
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == sorted(written)
    export_plan(renamed(name), tmp_path / "plan.npz")
    with zipfile.ZipFile(tmp_path / "plan.npz") as archive:
        assert not [member for member in archive.namelist() if {"..", "."} & set(member.split("/")) or "\\" in member]
    with np.load(tmp_path / "plan.npz") as arrays:
        assert list(arrays["arms"]) == [name, "right"] or list(arrays["arms"]) == ["right", name]


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)"])
def test_a_name_is_no_formula_in_a_spreadsheet(tmp_path, name):
    export_plan(renamed(name), tmp_path / "plan.csv")
    header, _ = table(tmp_path / "plan.csv")
    assert f"'{name}/joint1" in header
    assert not [cell for cell in header if cell[0] in "=+-@"]
