"""`mmp plan --retime`: the plan is retimed before it is written, checked and executed."""

import json

import numpy as np
import pytest
from support import bad_files

from mmp_env.files.plan_file import load_plan


def test_a_retimed_plan_is_written_checked_executed_and_reported(mmp, stand_ins, instances, tmp_path):
    out = tmp_path / "plan.json"
    ran = mmp("plan", instances, "--planner", "straight", "--retime", "--execute", "--out", out)
    assert ran.code == 0
    for words in ["s retimed", "as planned", "that velocity limits alone allow", "valid; clearance", "of its rating"]:
        assert words in ran.out
    plan = load_plan(out)
    np.testing.assert_allclose(np.diff(plan.times), 0.004, rtol=1e-9)
    assert {"max_acceleration", "max_jerk", "velocities", "accelerations"} <= vars(plan).keys()
    assert plan.accelerations is not None
    assert mmp("check", out).code == 0


def test_the_summary_warns_of_an_executed_plan_that_is_not_retimed(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "straight", "--execute", "--no-retime")
    assert ran.code == 0
    (warning,) = [line for line in ran.out.splitlines() if line.startswith("warning")]
    assert "--no-retime" in warning
    for options in [["--retime", "--execute"], ["--execute"], ["--retime"], []]:
        assert "warning" not in mmp("plan", instances, "--planner", "straight", *options).out


def test_a_plan_is_retimed_where_it_is_executed_or_filmed_unless_that_is_declined(mmp, stand_ins, instances, tmp_path):
    for options, retimed in [(["--execute"], True), (["--execute", "--no-retime"], False), ([], False)]:
        out = tmp_path / "plan.json"
        assert mmp("plan", instances, "--planner", "straight", *options, "--out", out).code == 0
        assert load_plan(out).retimed == retimed


def test_the_options_of_retiming_reach_it(mmp, stand_ins, instances, tmp_path):
    out = tmp_path / "plan.json"
    limits = ["--max-acceleration", "3", "--max-jerk", "200", "--rate", "100", "--tolerance", "0.02"]
    ran = mmp("plan", instances, "--planner", "straight", "--retime", *limits, "--out", out, "--json")
    assert (ran.code, ran.result["retimed"]["tolerance_rad"]) == (0, 0.02)
    plan = load_plan(out)
    np.testing.assert_allclose(np.diff(plan.times), 0.01, rtol=1e-9)
    assert max(rows.max() for rows in plan.max_acceleration.values()) <= 3
    assert max(rows.max() for rows in plan.max_jerk.values()) <= 200
    assert max(np.abs(rows).max() for rows in plan.accelerations.values()) <= 3


@pytest.mark.parametrize("option", ["--max-acceleration", "--max-jerk", "--rate", "--tolerance"])
def test_an_option_of_retiming_needs_it(mmp, stand_ins, instances, option):
    for more in [[], ["--execute", "--no-retime"]]:
        ran = mmp("plan", instances, "--planner", "straight", option, "30", *more)
        assert ran.code == 2
        assert f"{option} is for retiming" in ran.err


def test_retiming_is_asked_for_or_declined(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "straight", "--retime", "--no-retime")
    assert ran.code == 2
    assert "not allowed with" in ran.err


def test_the_velocity_limit_holds_for_every_joint(mmp, stand_ins, instances, tmp_path):
    out = tmp_path / "plan.json"
    assert mmp("plan", instances, "--planner", "straight", "--max-velocity", "0.25", "--out", out).code == 0
    plan = load_plan(out)
    assert max(rows.max() for rows in plan.problem.max_velocity.values()) == 0.25
    assert max(np.abs(np.diff(q, axis=0)).max(axis=1) @ np.ones(len(q) - 1) for q in plan.positions.values()) > 0


def test_the_summary_says_what_to_do_next(mmp, stand_ins, instances, tmp_path):
    out = tmp_path / "plan.json"
    (line,) = [x for x in mmp("plan", instances, "--planner", "straight").out.splitlines() if x.startswith("next")]
    assert "--execute plays the plan in MuJoCo, --out FILE keeps it" in line
    ran = mmp("plan", instances, "--planner", "straight", "--out", out)
    assert f"mmp export {out} --to motion.csv" in ran.out.replace("\n", "")
    assert "next" not in mmp("plan", instances, "--planner", "straight", "--execute").out


def test_json_has_the_makespans(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "straight", "--json", "--retime", "--execute")
    stats = ran.result["retimed"]
    assert ran.code == 0
    assert ran.result["makespan_s"] == stats["makespan_s"] > stats["fastest_s"]
    assert stats["fastest_s"] == pytest.approx(0.5 / 0.8)
    assert stats["given_s"] == pytest.approx(0.5 / 0.8 * 1.01)
    assert stats["seconds"] > 0
    execution = ran.result["execution"]
    assert execution["max_tracking_error_rad"] < 1e-3
    assert 0 < execution["loads"]["left"]["torque_nm"] < execution["loads"]["left"]["rated_nm"]
    assert execution["nearness"]["closer_m"] == 0
    assert execution["halts"] == []
    assert "retimed" not in mmp("plan", instances, "--planner", "straight", "--json").result


def test_without_a_plan_there_is_nothing_to_retime(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "helpless", "--json", "--retime")
    assert (ran.code, ran.result["retimed"]) == (1, None)


def test_a_plan_that_cannot_be_retimed_is_kept_and_the_reason_printed(mmp, stand_ins, tmp_path):
    data = bad_files.good_instances()
    block = {"name": "block", "shape": "box", "position": [-1.3, -0.1, 0.5], "size": [0.2, 0.2, 0.2]}
    data["cell"]["obstacles"].append(block)
    for end, turn in (("start", -1.0), ("goal", 1.0)):
        data["instances"][0][end]["left"] = [turn, -0.6, 0.3, -1.2, 0.0, 0.0]
    path = tmp_path / "blocked.json"
    path.write_text(json.dumps(data))
    ran = mmp("plan", path, "--planner", "straight", "--json", "--retime", "--out", tmp_path / "plan.json")
    assert "--retime: the plan cannot be proved clear of conflicts" in ran.err
    assert "REFUTES" in ran.err
    assert ran.result["retimed"] is None
    assert ran.result["makespan_s"] > 0
    assert load_plan(tmp_path / "plan.json").accelerations is None
    assert ran.code == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--rate", "1"], "rate is 1; a motion needs at least 20"),
        (["--tolerance", "4"], "tolerance is 4.0; it must be"),
    ],
)
def test_an_option_of_retiming_out_of_bounds_is_refused_before_planning(mmp, stand_ins, instances, words, sentence):
    ran = mmp("plan", instances, "--planner", "straight", "--retime", *words)
    assert ran.code == 2
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
    assert stand_ins.Straight.calls == []
