"""`mmp run`: writes a schedule that `mmp check` takes, and says what is wrong."""

from __future__ import annotations

import json

import pytest

from mmp_cli.main import main
from tests.support.interrupted_calls import interrupting
from tests.support.small_jobs import in_a_ring, pose


def test_a_schedule_is_written_executed_and_checked_again(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    out = tmp_path / "schedule.json"
    assert main(["run", str(tmp_path / "jobs.json"), "--out", str(out), "--execute", "--json"]) == 0
    line = json.loads(capsys.readouterr().out)
    assert line["valid"]
    assert line["status"] == "solved"
    assert line["schedule"] == str(out)
    assert line["execution"]["contacts"] == []
    assert line["execution"]["reached"]
    assert main(["check", str(out)]) == 0
    assert "valid; clearance" in capsys.readouterr().out


def test_the_summary_says_what_was_done(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    assert main(["run", str(tmp_path / "jobs.json")]) == 0
    said = capsys.readouterr().out
    assert "4 jobs, 4 arms in cell ring-4" in said
    assert "valid; clearance" in said


def test_delays_are_executed_without_contact(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    assert main(["run", str(tmp_path / "jobs.json"), "--delays", "2", "--json"]) == 0
    line = json.loads(capsys.readouterr().out)
    assert line["delays_s"] == 2.0
    assert line["execution"]["contacts"] == []
    assert line["execution"]["duration_s"] > line["makespan_s"] + 1.0


def test_limits_that_are_asked_for_are_kept(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    out = tmp_path / "schedule.json"
    limits = ["--max-acceleration", "2", "--max-jerk", "50"]
    assert main(["run", str(tmp_path / "jobs.json"), "--out", str(out), *limits, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["valid"]
    written = json.loads(out.read_text())
    assert written["max_acceleration"]["arm0"] == [2.0] * 6
    assert written["max_jerk"]["arm0"] == [50.0] * 6


def test_bad_jobs_are_refused_with_one_sentence(tmp_path, capsys):
    jobs = [{"name": "far", "arm": "arm0", "steps": [{"move": pose(9.0, 0.0, 0.5)}]}]
    for data in (in_a_ring(jobs=jobs), in_a_ring(cell="rink-4")):
        (tmp_path / "jobs.json").write_text(json.dumps(data))
        assert main(["run", str(tmp_path / "jobs.json"), "--out", str(tmp_path / "s.json")]) == 2
        assert capsys.readouterr().err.count("\n") == 1
        assert not (tmp_path / "s.json").exists()


def test_no_time_is_no_schedule(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    assert main(["run", str(tmp_path / "jobs.json"), "--out", str(tmp_path / "s.json"), "--time-limit", "1e-6"]) == 1
    assert "no motion was found" in capsys.readouterr().err
    assert not (tmp_path / "s.json").exists()


def test_a_margin_that_is_asked_for_is_kept_or_refused(tmp_path, capsys):
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    assert main(["run", str(tmp_path / "jobs.json"), "--margin", "arms=0.004", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["margins_proved"]["arms"] >= 0.004
    assert main(["run", str(tmp_path / "jobs.json"), "--margin", "0.5"]) == 2
    assert "the largest margin that would do" in capsys.readouterr().err


@pytest.fixture
def jobs(tmp_path):
    """Returns the path of a good file of jobs."""
    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    return tmp_path / "jobs.json"


def test_ctrl_c_while_improving_gives_the_summary_or_the_object_of_the_shortest_schedule(mmp, jobs, monkeypatch):
    interrupting(monkeypatch, "mmp_planners.work.scheduling.improved")
    ran = mmp("run", jobs, "--improve", 60, "--execute")
    assert (ran.code, ran.err) == (130, "mmp: interrupted\n")
    for words in (
        "interrupted; solved",
        "single-arm searches",
        "left out, the run was interrupted",
        "not done: the run",
    ):
        assert words in ran.out
    ran = mmp("run", jobs, "--improve", 60, "--execute", "--json")
    assert ran.code == 130
    assert (ran.result["status"], ran.result["valid"], ran.result["execution"]) == ("solved", None, None)
    assert ran.result["makespan_s"] == ran.result["first_makespan_s"] > 0
    assert ran.result["attempts"] is None


def test_ctrl_c_before_there_is_a_schedule_gives_an_object_without_one(mmp, jobs, tmp_path, monkeypatch):
    interrupting(monkeypatch, "mmp_planners.work.scheduling.first_world")
    ran = mmp("run", jobs, "--json", "--out", tmp_path / "schedule.json")
    assert (ran.code, ran.err) == (130, "mmp: interrupted; no schedule file was written\n")
    assert (ran.result["status"], ran.result["makespan_s"]) == ("timeout", None)
    assert ran.result["message"] == "the run was interrupted before there was a schedule"
    ran = mmp("run", jobs)
    assert (ran.code, ran.err) == (130, "mmp: interrupted\n")
    assert "interrupted; timeout" in ran.out


def test_the_first_ctrl_c_lets_the_schedule_file_be_finished_and_a_second_leaves_nothing(
    mmp, jobs, tmp_path, monkeypatch
):
    out = tmp_path / "schedule.json"
    with monkeypatch.context() as patch:
        interrupting(patch, "mmp_env.work.schedule_file.json_text", times=2)
        assert mmp("run", jobs, "--out", out).code == 130
        assert [file.name for file in tmp_path.iterdir()] == ["jobs.json"]
    interrupting(monkeypatch, "mmp_env.work.schedule_file.json_text")
    ran = mmp("run", jobs, "--out", out, "--execute", "--json")
    assert (ran.code, ran.result["schedule"], ran.result["valid"]) == (130, str(out), None)
    assert ran.err == f"mmp: interrupted; {out} holds the schedule, not checked, not executed\n"
    monkeypatch.undo()
    assert mmp("check", out).code == 0


def test_ctrl_c_during_the_check_names_the_file_and_what_it_lacks(mmp, jobs, tmp_path, monkeypatch):
    interrupting(monkeypatch, "mmp_env.check.schedule.check_schedule_document")
    out = tmp_path / "schedule.json"
    ran = mmp("run", jobs, "--out", out)
    assert (ran.code, ran.err) == (130, f"mmp: interrupted; {out} holds the schedule, not checked\n")
    assert "left out, the run was interrupted" in ran.out


def test_ctrl_c_writes_the_shortest_schedule_so_far(tmp_path, capsys, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    (tmp_path / "jobs.json").write_text(json.dumps(in_a_ring()))
    monkeypatch.setattr("mmp_planners.work.scheduling.improved", interrupt)
    out = tmp_path / "schedule.json"
    words = ["run", str(tmp_path / "jobs.json"), "--improve", "60"]
    assert main([*words, "--out", str(out)]) == 130
    assert capsys.readouterr().err == f"mmp: interrupted; {out} holds the shortest schedule so far, not checked\n"
    assert main(["check", str(out)]) == 0
    assert main(words) == 130
    monkeypatch.setattr("mmp_planners.work.scheduling._Setup.attempt", interrupt)
    assert main([*words, "--out", str(tmp_path / "none.json")]) == 130
    assert not (tmp_path / "none.json").exists()
