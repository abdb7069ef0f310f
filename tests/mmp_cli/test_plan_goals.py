"""`--start`, `--goal`, `--degrees` and `--keep` of `mmp plan`: what they ask for, and how they are refused."""

import json
import math
import re

import numpy as np
import pytest
from support.refusals import assert_refused

HOLD = {"arm0": [0, -90, 90, -90, -90, 0], "arm1": [0, -90, 90, -90, -90, 0]}
SPUN = [2.6052, -2.2, 2.5, -1.87, -1.5708, 0.5]
"""`tucked` of a UR5e, its last joint turned."""
UPRIGHT = {"upright": {"axis": [0, 0, -1], "within": 0.3}}


@pytest.fixture
def given(mmp, stand_ins, tmp_path):
    """Plans a pair of arms from a start to a goal; returns the run and the plan file's content."""

    def run(start, goal, *options):
        out = tmp_path / "plan.json"
        words = [word if isinstance(word, str) else json.dumps(word) for word in (start, goal)]
        ran = mmp(
            "plan",
            "MultiArmCell-2",
            "--planner",
            "straight",
            "--start",
            words[0],
            "--goal",
            words[1],
            "--out",
            out,
            *options,
        )
        return ran, json.loads(out.read_text()) if out.exists() else None

    return run


def turned(degrees):
    return {name: [*q[:5], degrees] for name, q in HOLD.items()}


def test_degrees_are_degrees_everywhere_in_goals(given):
    anywhere = {"arm0": {"any": [turned(40)["arm0"], {"any": [turned(30)["arm0"]]}]}, "arm1": "stay"}
    ran, plan = given(HOLD, anywhere, "--degrees")
    assert ran.code == 0, ran.err
    assert plan["problem"]["start"]["arm0"] == pytest.approx(np.radians(HOLD["arm0"]).tolist())
    assert plan["problem"]["goal"]["arm0"][5] == pytest.approx(math.radians(30))
    first = plan["problem"]["goal_asked"]["arm0"]["any"][0]
    assert first == pytest.approx(np.radians(turned(40)["arm0"]).tolist())


def test_without_degrees_a_configuration_in_degrees_is_refused(given):
    ran, _ = given(HOLD, turned(30))
    assert_refused(ran, "looks like degrees")


@pytest.mark.parametrize(
    "forms",
    [
        [f"arm0={json.dumps(UPRIGHT)}"],
        [json.dumps({"arm0": UPRIGHT})],
        ["@keep.json"],
        ["arm0=@one.json"],
    ],
)
def test_keep_has_the_forms_of_plan_files(given, tmp_path, monkeypatch, forms):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "keep.json").write_text(json.dumps({"arm0": UPRIGHT}))
    (tmp_path / "one.json").write_text(json.dumps(UPRIGHT))
    ran, plan = given(HOLD, turned(30), "--degrees", *(word for form in forms for word in ("--keep", form)))
    assert ran.code == 0, ran.err
    assert plan["problem"]["keep"] == {"arm0": UPRIGHT}
    assert "arm0 within 0.3 rad of upright, axis [0, 0, -1]" in ran.out


def test_several_bounds_are_given_one_by_one(given):
    both = [word for arm in HOLD for word in ("--keep", f"{arm}={json.dumps(UPRIGHT)}")]
    ran, plan = given(HOLD, turned(30), "--degrees", *both)
    assert ran.code == 0, ran.err
    assert set(plan["problem"]["keep"]) == set(HOLD)


@pytest.mark.parametrize(
    ("keep", "words"),
    [
        ("arm9={}", ["--keep", "unknown arm 'arm9'", "arm0"]),
        ("arm0={}", ["--keep", "arm0", "upright"]),
        ("arm0=", ["--keep arm0", "not JSON"]),
        ("arm0", ["--keep", "not JSON"]),
        ("{", ["--keep is not JSON"]),
        ("@", ["--keep is '@'", "@FILE"]),
        ("@none.json", ["none.json"]),
        ("[]", ["--keep is []", "arm name"]),
        ("null", ["--keep is null", "arm name"]),
        ("arm0=[]", ["--keep of arm 'arm0' is []", "upright"]),
        ('arm0={"upright": {"axis": [0, 0, 0], "within": 0.2}}', ["arm0", "axis", "not all zero"]),
        ('arm0={"upright": {"axis": [0, 0, 1], "within": 12}}', ["arm0", "12", "radians"]),
        ('arm0={"upright": {"axis": [0, 0, 1], "within": NaN}}', ["of arm 'arm0'", "is nan", "radians"]),
        ('arm0={"upright": {"axis": [0, 0, 1], "with": 1}}', ["arm0", "within"]),
        ('arm0={"upright": {"axis": [0, 0, 1], "within": 0.2}}', ["start of arm 'arm0'", "rad"]),
        ("", ["argument --keep is empty"]),
    ],
)
def test_a_bound_that_is_wrong_or_broken_is_refused(given, tmp_path, monkeypatch, keep, words):
    monkeypatch.chdir(tmp_path)
    ran, plan = given(HOLD, turned(30), "--degrees", "--keep", keep)
    assert_refused(ran, *words)
    assert plan is None


def test_a_bound_is_given_once_and_to_no_instance_file(given, mmp, instances):
    twice = ["--keep", f"arm0={json.dumps(UPRIGHT)}", "--keep", json.dumps({"arm0": UPRIGHT})]
    assert_refused(given(HOLD, turned(30), "--degrees", *twice)[0], "--keep gives arm 'arm0' twice")
    assert_refused(mmp("plan", instances, "--keep", json.dumps({"left": UPRIGHT})), "--keep", "instance file")


def test_a_file_of_keep_is_not_overwritten(mmp, tmp_path, stand_ins):
    path = tmp_path / "keep.json"
    path.write_text(json.dumps({"arm0": UPRIGHT}))
    ran = mmp("plan", "MultiArmCell-2", "--planner", "straight", "--keep", f"@{path}", "--out", path)
    assert_refused(ran, "--out would overwrite")


def pose(position, quaternion, **fields):
    return json.dumps({"arm0": {"pose": {"position": position, "quaternion": quaternion, **fields}}})


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (pose([1e300, 0, 0], [0, 1, 0, 0]), ["--goal: arm0", "the position of a pose", "1e+06 at most"]),
        (pose([0.1, 0.15, 0.3], [0, 1, 0, 0], free="x"), ["--goal: arm0: unknown freedom of a pose 'x'. Known"]),
        ('{"arm0": null}', ["--goal: arm0 is null", "home", '"pose"']),
        ('{"arm0": 3}', ["--goal: arm0 is 3", '"pose"']),
        ("null", ["--goal is null", "arm name -> configuration or goal"]),
    ],
)
def test_a_goal_that_is_none_is_refused(given, goal, words):
    ran, plan = given(dict.fromkeys(HOLD, "tucked"), goal)
    assert_refused(ran, *words)
    assert plan is None


@pytest.mark.parametrize("length", [1e-320, 1e300])
def test_a_quaternion_may_have_any_length(mmp, length):
    start = json.dumps(dict.fromkeys(HOLD, "tucked"))
    goal = pose([0.1, 0.15, 0.3], [0, length, 0, 0], free="z")
    assert mmp("plan", "MultiArmCell-2", "--start", start, "--goal", goal).code == 0


def test_a_named_configuration_alone_is_that_of_all_arms(given):
    _, plan = given("tucked", {"arm0": SPUN})
    assert plan["problem"]["start"]["arm1"] == plan["problem"]["goal"]["arm1"] == pytest.approx([*SPUN[:5], 0])
    ran, _ = given("hom", "stay")
    assert_refused(ran, "unknown named configuration 'hom'. Did you mean 'home'?")


def test_goals_of_arms_may_be_given_one_by_one(given):
    ran, plan = given(HOLD, f"arm0={json.dumps(turned(30)['arm0'])}", "--goal", "arm1=stay", "--degrees")
    assert ran.code == 0, ran.err
    assert plan["problem"]["goal"]["arm0"][5] == pytest.approx(math.radians(30))
    ran, _ = given(HOLD, "arm0=home", "--goal", "arm0=tucked", "--degrees")
    assert_refused(ran, "--goal gives arm 'arm0' twice")


def test_a_margin_that_no_candidate_keeps_is_refused_with_the_largest_that_would_do(given):
    goal = {"arm0": SPUN}
    ran, _ = given("tucked", goal, "--margin", "0.5")
    found = re.search(r"the largest margin that would do is ([\d.]+) mm", ran.err)
    assert found is not None, ran.err
    most = float(found[1]) / 1e3
    ran, _ = given("tucked", goal, "--margin", f"{most - 1e-5:.6f}")
    assert ran.code == 0, ran.err
    ran, _ = given("tucked", goal, "--margin", f"{most + 1e-4:.6f}")
    assert_refused(ran, "the largest margin that would do")
