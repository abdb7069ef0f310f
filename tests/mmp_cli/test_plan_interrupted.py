"""`mmp plan` that Ctrl-C or SIGTERM ends: it keeps what it has, and says what that lacks."""

import os
import re
import signal

import pytest
from support.interrupted_calls import interrupting

from mmp_env.files.plan_file import load_plan


def test_ctrl_c_keeps_the_best_so_far_and_is_exit_130(mmp, stand_ins, instances, tmp_path):
    before = signal.getsignal(signal.SIGINT)
    ran = mmp("plan", instances, "--planner", "interrupted", "--json", "--execute", "--out", tmp_path / "plan.json")
    assert ran.code == 130
    assert ran.result["valid"] is None
    assert ran.result["execution"] is None
    assert len(load_plan(tmp_path / "plan.json").times) == 5
    assert signal.getsignal(signal.SIGINT) is before
    assert "interrupted" in mmp("plan", instances, "--planner", "interrupted").out


def test_ctrl_c_before_there_is_a_plan_writes_nothing(mmp, stand_ins, instances, tmp_path):
    options = ["--set", "solved=off", "--json", "--out", tmp_path / "plan.json"]
    ran = mmp("plan", instances, "--planner", "interrupted", *options)
    assert (ran.code, ran.result["status"], ran.result["plan"]) == (130, "timeout", None)
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_a_second_ctrl_c_ends_at_once(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "interrupted", "--set", "times=2", "--out", tmp_path / "plan.json")
    assert (ran.code, ran.out, ran.err) == (130, "", "mmp: interrupted\n")
    assert os.listdir(tmp_path) == ["pairs.json"]


STEPS = {
    "retiming": ("mmp_env.retime.retime_with_report", ["not retimed", "not checked", "not executed"]),
    "checking": ("mmp_env.check.check_document", ["not checked", "not executed"]),
    "execution": ("mmp_cli.execution.execute", ["not executed"]),
}


@pytest.mark.parametrize("step", STEPS)
def test_ctrl_c_after_the_planning_names_the_plan_file_and_what_it_lacks(
    mmp, stand_ins, instances, tmp_path, monkeypatch, step
):
    function, lacking = STEPS[step]
    monkeypatch.setattr(function, lambda *_, **__: signal.raise_signal(signal.SIGINT))
    out = tmp_path / "plan.json"
    ran = mmp("plan", instances, "--planner", "straight", "--retime", "--execute", "--out", out)
    assert ran.code == 130
    assert ran.err == f"mmp: interrupted; {out} holds the plan, {', '.join(lacking)}\n"
    assert load_plan(out).retimed == (step != "retiming")
    assert re.search(r"^execution +not done: the run was interrupted$", ran.out, re.MULTILINE)
    assert bool(re.search(r"^retiming +not done", ran.out, re.MULTILINE)) == (step == "retiming")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_after_the_plan_was_written_gives_the_same_sentence(
    mmp, stand_ins, instances, tmp_path, monkeypatch, number
):
    def check_plan(plan):
        signal.raise_signal(number)

    monkeypatch.setattr("mmp_env.check.check_document", check_plan)
    out = tmp_path / "plan.json"
    ran = mmp("plan", instances, "--planner", "straight", "--out", out)
    how = "interrupted" if number == signal.SIGINT else "ended by SIGTERM"
    assert (ran.code, ran.err) == (128 + number, f"mmp: {how}; {out} holds the plan, not checked\n")


def test_ctrl_c_that_the_planner_lost_is_raised_again_at_the_next_event(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "deaf", "--json")
    assert (ran.code, ran.result["status"]) == (130, "timeout")


WRITING = (
    "mmp_env.files.plan_file.plan_to_dict",
    "mmp_env.files.plan_file.json_text",
    "mmp_env.files.writing.move_onto",
)


@pytest.mark.parametrize("function", WRITING)
def test_the_first_ctrl_c_lets_the_plan_file_be_finished(mmp, stand_ins, instances, tmp_path, monkeypatch, function):
    interrupting(monkeypatch, function)
    out = tmp_path / "plan.json"
    ran = mmp("plan", instances, "--planner", "straight", "--json", "--execute", "--out", out)
    assert (ran.code, ran.result["plan"], ran.result["valid"], ran.result["execution"]) == (130, str(out), None, None)
    assert ran.err == f"mmp: interrupted; {out} holds the plan, not checked, not executed\n"
    assert load_plan(out).retimed
    assert sorted(os.listdir(tmp_path)) == ["pairs.json", "plan.json"]


@pytest.mark.parametrize("function", WRITING)
def test_a_second_ctrl_c_while_the_plan_file_is_written_leaves_nothing(
    mmp, stand_ins, instances, tmp_path, monkeypatch, function
):
    interrupting(monkeypatch, function, times=2)
    ran = mmp("plan", instances, "--planner", "straight", "--out", tmp_path / "plan.json")
    assert (ran.code, ran.out, ran.err) == (130, "", "mmp: interrupted; no plan file was written\n")
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_ctrl_c_between_planning_and_writing_keeps_the_plan(mmp, stand_ins, instances, tmp_path, monkeypatch):
    interrupting(monkeypatch, "mmp_cli.plan_steps.first_outcome")
    out = tmp_path / "plan.json"
    ran = mmp("plan", instances, "--planner", "straight", "--retime", "--out", out)
    assert (ran.code, ran.err) == (130, f"mmp: interrupted; {out} holds the plan, not retimed, not checked\n")
    assert not load_plan(out).retimed


def test_a_ctrl_c_after_one_that_ended_the_planning_ends_the_writing(mmp, stand_ins, instances, tmp_path, monkeypatch):
    interrupting(monkeypatch, "mmp_env.files.plan_file.json_text")
    ran = mmp("plan", instances, "--planner", "interrupted", "--out", tmp_path / "plan.json")
    assert (ran.code, ran.out) == (130, "")
    assert os.listdir(tmp_path) == ["pairs.json"]
