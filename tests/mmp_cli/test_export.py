"""`mmp export`: its files, its messages, and the arguments that it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from support import tiny_plans
from support.refusals import assert_refused

from mmp_env.export import load_joint_trajectory
from mmp_env.retime import retime


@pytest.fixture
def plan_path(tmp_path):
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(tiny_plans.two_apart()))
    return path


def test_each_format_is_written_and_reported_in_a_line(mmp, plan_path, tmp_path):
    for name in ("plan.csv", "plan.npz", "plan.yaml"):
        ran = mmp("export", plan_path, "--no-retime", "--to", tmp_path / name)
        assert (ran.code, ran.err) == (0, "")
        assert (
            ran.out
            == f"{tmp_path / name}: 12 joints at 3 times, {length():.1f} s; positions only, the plan is not retimed\n"
        )
        assert (tmp_path / name).stat().st_size > 0
    ran = mmp("export", plan_path, "--to", tmp_path / "cell.xml")
    assert (ran.code, ran.out) == (0, f"{tmp_path / 'cell.xml'}: 2 arms, keyframes start and goal\n")


def test_a_motion_is_retimed_unless_that_is_declined_or_its_plan_is(mmp, plan_path, tmp_path):
    ran = mmp("export", plan_path, "--to", tmp_path / "plan.yaml", "--rate", "100")
    assert (ran.code, ran.err) == (0, "")
    assert "retimed for the file; --no-retime writes the plan as it is" in ran.out
    assert "positions, velocities and accelerations" in ran.out
    assert np.diff(load_joint_trajectory(tmp_path / "plan.yaml").times) == pytest.approx(0.01)
    assert "retimed for" not in mmp("export", plan_path, "--to", tmp_path / "cell.xml").out
    assert_refused(mmp("export", plan_path, "--no-retime", "--rate", "9", "--to", tmp_path / "a.csv"), "--rate is for")


@pytest.mark.parametrize(
    ("field", "kind"),
    [("arms", "a cell file"), ("instances", "an instance file"), ("positions", "a plan"), ("plans", "an episode")],
)
def test_a_cell_an_instance_file_and_a_plan_are_not_overwritten(mmp, plan_path, tmp_path, field, kind):
    (tmp_path / "left.yaml").write_text(f"{field}: []\n")
    for name in ("left.yaml", "{arm}.yaml"):
        assert_refused(mmp("export", plan_path, "--to", tmp_path / name), "--to would overwrite", f"which is {kind};")
    assert (tmp_path / "left.yaml").read_text() == f"{field}: []\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["left.yaml", "plan.json"]


@pytest.mark.parametrize("before", ["", "a: note\n", "{"])
def test_another_file_and_an_earlier_export_are_overwritten(mmp, plan_path, tmp_path, before):
    (tmp_path / "motion.yaml").write_text(before)
    for _ in range(2):
        assert mmp("export", plan_path, "--to", tmp_path / "motion.yaml").code == 0
    assert load_joint_trajectory(tmp_path / "motion.yaml")


def length():
    return tiny_plans.two_apart()["times"][-1]


def test_a_trajectory_for_each_arm_with_names_as_ros_likes_them(mmp, plan_path, tmp_path):
    ran = mmp("export", plan_path, "--to", tmp_path / "{arm}.yaml", "--joint-names", "{arm}_{joint}", "--no-retime")
    assert ran.code == 0
    assert len(ran.out.splitlines()) == 2
    for arm in ("left", "right"):
        trajectory = load_joint_trajectory(tmp_path / f"{arm}.yaml")
        assert trajectory.joint_names[0] == f"{arm}_joint1"
        np.testing.assert_array_equal(trajectory.positions, tiny_plans.two_apart()["positions"][arm])


def test_a_refuted_plan_is_written_with_a_loud_warning_and_code_1(mmp, plan_path, tmp_path):
    wrong = tiny_plans.two_apart()
    wrong["problem"]["goal"]["left"][0] += 0.5
    plan_path.write_text(json.dumps(wrong))
    ran = mmp("export", plan_path, "--to", tmp_path / "plan.csv")
    assert ran.code == 1
    assert ran.err.startswith("mmp: THE CHECKER REFUTES")
    assert ran.err.count("\n") == 1
    assert (tmp_path / "plan.csv").exists()


def test_a_retimed_motion_that_the_checker_refutes_is_written_with_a_loud_warning(
    mmp, plan_path, tmp_path, monkeypatch
):
    def wrong(plan, **options):
        out = retime(plan, **options)
        return replace(out, velocities={arm: 2 * rates for arm, rates in out.velocities.items()})

    monkeypatch.setattr("mmp_env.retime.retime", wrong)
    ran = mmp("export", plan_path, "--to", tmp_path / "plan.csv")
    assert ran.code == 1
    assert ran.err.startswith(f"mmp: THE CHECKER REFUTES THE RETIMED PLAN OF {plan_path}: ")
    assert "states a velocity of" in ran.err
    assert (tmp_path / "plan.csv").exists()


def there_and_back():
    there = tiny_plans.two_apart()
    back = tiny_plans.two_apart()
    back["positions"] = {arm: rows[::-1] for arm, rows in there["positions"].items()}
    back["problem"]["start"], back["problem"]["goal"] = there["problem"]["goal"], there["problem"]["start"]
    back["times"] = [back["times"][-1] - t for t in back["times"][::-1]]
    return tiny_plans.copy_of({"schema": "mmp-episode/1", "name": "there and back", "plans": [there, back]})


def test_an_episode_is_one_motion(mmp, plan_path, tmp_path):
    plan_path.write_text(json.dumps(there_and_back()))
    ran = mmp("export", plan_path, "--no-retime", "--to", tmp_path / "all.yaml")
    assert (ran.code, ran.err) == (0, "")
    trajectory = load_joint_trajectory(tmp_path / "all.yaml")
    assert len(trajectory.times) == 5
    assert trajectory.times[-1] == pytest.approx(2 * length())
    np.testing.assert_array_equal(trajectory.positions[0], trajectory.positions[-1])


def test_the_wrong_plan_of_an_episode_is_named(mmp, plan_path, tmp_path):
    episode = there_and_back()
    episode["plans"][1]["problem"]["goal"]["left"][0] += 0.5
    plan_path.write_text(json.dumps(episode))
    ran = mmp("export", plan_path, "--to", tmp_path / "all.csv")
    assert ran.code == 1
    assert "REFUTES" in ran.err
    assert "plan.json: plan 1: goal: arm 'left'" in ran.err
    assert mmp("check", plan_path).out.splitlines()[1].startswith("  plan 1: goal: arm 'left'")
    del episode["plans"][1]["times"]
    plan_path.write_text(json.dumps(episode))
    assert_refused(mmp("export", plan_path, "--to", tmp_path / "more.csv"), "plans[1]", "times")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: data.update(name="a/b"), ["name is 'a/b'"]),
        (lambda data: data.update(name=3), ["name is 3"]),
        (lambda data: data.update(plans=[]), ["plans is empty"]),
        (lambda data: data.update(plans={}), ["plans is {}", "a list"]),
        (lambda data: data.update(length=2), ["unknown field 'length'"]),
        (lambda data: data["plans"][1].update(schema="mmp-plan/2"), ["plans[1].schema is 'mmp-plan/2'"]),
    ],
)
def test_export_refuses_unreadable_files_in_the_words_of_check(mmp, plan_path, tmp_path, spoil, words):
    episode = there_and_back()
    spoil(episode)
    plan_path.write_text(json.dumps(episode))
    refused = mmp("export", plan_path, "--to", tmp_path / "all.csv")
    assert_refused(refused, *words)
    assert mmp("check", plan_path).err == refused.err
    assert [path.name for path in tmp_path.iterdir()] == ["plan.json"]


def test_check_and_export_name_the_same_plans_of_an_episode_that_jumps(mmp, plan_path, tmp_path):
    episode = there_and_back()
    for rows in (episode["plans"][1]["problem"]["start"], {"left": episode["plans"][1]["positions"]["left"][0]}):
        rows["left"][1] += 0.01
    plan_path.write_text(json.dumps(episode))
    assert_refused(mmp("export", plan_path, "--to", tmp_path / "all.csv"), "plan 1 does not go on from plan 0")
    assert "plan 1 does not go on from plan 0: arm 'left'" in mmp("check", plan_path).out


def test_an_episode_whose_arms_were_moved_between_plans_is_refuted(mmp, plan_path, tmp_path):
    episode = there_and_back()
    episode["plans"][1]["problem"]["cell"]["arms"][0]["position"][0] -= 0.1
    plan_path.write_text(json.dumps(episode))
    ran = mmp("export", plan_path, "--to", tmp_path / "all.csv")
    assert ran.code == 1
    assert "its arms are others, or stand elsewhere" in ran.err


def test_the_plan_itself_is_not_overwritten(mmp, tmp_path):
    path = tmp_path / "left.yaml"
    path.write_text(yaml.safe_dump(tiny_plans.two_apart()))
    before = path.read_text()
    for to in ("left.yaml", "{arm}.yaml", "no/../left.yaml"):
        assert_refused(
            mmp("export", path, "--to", tmp_path / to), f"--to would overwrite {path} itself; give another name"
        )
    assert path.read_text() == before
    assert mmp("export", path, "--to", tmp_path / "other.YAML").code == 0


@pytest.mark.parametrize(
    ("to", "words"),
    [
        ("plan.yalm", ["unknown export format '.yalm'. Did you mean '.yaml'?", ".csv, .npz, .xml, .yaml"]),
        ("plan", ["does not say in which format"]),
        ("{arms}.yaml", ["unknown placeholder of file names 'arms'. Did you mean 'arm'?"]),
        ("no/such/folder.csv", ["cannot be written"]),
    ],
)
def test_a_wrong_target_is_refused_and_nothing_written(mmp, plan_path, tmp_path, to, words):
    assert_refused(mmp("export", plan_path, "--to", tmp_path / to), *words)
    assert [path.name for path in tmp_path.iterdir()] == ["plan.json"]


def test_a_plan_that_cannot_be_read_is_refused_and_nothing_written(mmp, plan_path, tmp_path):
    plan_path.write_text("{}")
    assert_refused(mmp("export", plan_path, "--to", tmp_path / "plan.csv"), "plan.json")
    assert_refused(mmp("export", tmp_path / "none.json", "--to", tmp_path / "plan.csv"), "none.json", "No such file")
    assert [path.name for path in tmp_path.iterdir()] == ["plan.json"]


def test_the_target_must_be_given(mmp, plan_path):
    assert_refused(mmp("export", plan_path), "--to")
    assert_refused(mmp("export", plan_path, "--too", "plan.csv"), "--to")
