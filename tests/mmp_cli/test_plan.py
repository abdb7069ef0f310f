import json
import re

import gymnasium
import numpy as np
import pytest
import yaml
from support import bad_files, tiny_plans, two_arms

import mmp_env  # noqa: F401  registers the environments
import mmp_planners
from mmp_cli.plan import default_planner
from mmp_env.files.cell_file import cell_to_dict
from mmp_planners import Status

COUNTS = ["expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits"]
LINE = [
    *("instance", "planner", "seed", "status", "planning_time_s", "check_time_s", *COUNTS),
    *("cost_rad", "makespan_s", "root_conflicts", "cost_lower_bound_rad", "min_clearance_m"),
    *("margins_asked", "margins_proved"),
    *("bound_met", "deadline_hit", "plan", "version", "machine"),
]
ENDS = [
    "--start",
    json.dumps({"left": bad_files.TUCKED, "right": bad_files.TUCKED}),
    "--goal",
    json.dumps({"left": bad_files.TURNED, "right": bad_files.TURNED}),
]


def test_an_environment_id_is_planned_checked_and_executed(mmp, tmp_path):
    out = tmp_path / "plan.json"
    ran = mmp("plan", "MultiArmCell-2", "--seed", 3, "--execute", "--out", out)
    assert ran.code == 0
    for words in [
        "MultiArmCell-2/3",
        f"{default_planner()}, seed 3",
        "solved",
        "valid; clearance",
        "every goal reached",
        str(out),
    ]:
        assert words in ran.out
    assert mmp("check", out).code == 0


def test_the_summary_names_what_the_bound_on_the_cost_relates_to(mmp):
    words = ["plan", "MultiArmCell-4", "--seed", 2, "--planner", "apf-ecbs", "--set", "w=1.05", "--set"]
    assert "bound not met: 1.05 x the straight lines" in mmp(*words, "bound=straight").out
    assert "1.05 x the planner's own costs" in mmp(*words, "bound=paths").out


def test_the_same_command_gives_the_same_file(mmp, tmp_path):
    for name in ("one", "other"):
        assert mmp("plan", "MultiArmCell-2", "--planner", "ecbs", "--seed", 5, "--out", tmp_path / name).code == 0
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


@pytest.mark.parametrize("options", [[], ["--robot", "panda"]])
def test_the_instance_of_an_id_is_that_of_reset_with_the_same_seed(mmp, stand_ins, options):
    mmp("plan", "MultiArmCell-2", "--planner", "straight", "--seed", 11, *options)
    env = gymnasium.make("MultiArmCell-2", **({"robot": options[1]} if options else {}))
    env.reset(seed=11)
    problem, wanted = stand_ins.Straight.calls[0]["problem"], env.unwrapped.problem
    env.close()
    assert (problem.name, problem.margin) == ("MultiArmCell-2/11", wanted.margin)
    for arm in wanted.cell.arm_names:
        np.testing.assert_array_equal(problem.start[arm], wanted.start[arm])
        np.testing.assert_array_equal(problem.goal[arm], wanted.goal[arm])


def test_the_first_instance_of_a_file_is_the_default(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "straight", "--json")
    assert (ran.code, ran.result["instance"], ran.result["seed"]) == (0, "pair/turn", 0)
    assert mmp("plan", instances, "--instance", "turn", "--planner", "straight", "--json").result["valid"] is True


def test_a_cell_file_takes_its_start_and_goal_from_the_command_line(mmp, stand_ins, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(bad_files.good_cell()))
    ran = mmp("plan", path, "--planner", "straight", "--json", *ENDS)
    assert (ran.code, ran.result["instance"]) == (0, "pair/given")
    np.testing.assert_array_equal(stand_ins.Straight.calls[0]["problem"].goal["right"], bad_files.TURNED)


@pytest.mark.parametrize("suffix", ["json", "yaml"])
def test_start_and_goal_are_read_from_files_too(mmp, stand_ins, cell, tmp_path, suffix):
    start, goal = tmp_path / f"start.{suffix}", tmp_path / f"goal.{suffix}"
    start.write_text(json.dumps({"left": bad_files.TUCKED, "right": bad_files.TUCKED}))
    goal.write_text(json.dumps({"left": bad_files.TURNED, "right": bad_files.TURNED}))
    ran = mmp("plan", cell, "--planner", "straight", "--json", "--start", f"@{start}", "--goal", f"@{goal}")
    assert (ran.code, ran.result["instance"]) == (0, "pair/given")
    np.testing.assert_array_equal(stand_ins.Straight.calls[0]["problem"].start["right"], bad_files.TUCKED)
    np.testing.assert_array_equal(stand_ins.Straight.calls[0]["problem"].goal["right"], bad_files.TURNED)


def test_a_cell_file_draws_its_instance_by_seed(mmp, stand_ins, cell):
    for _ in range(2):
        assert mmp("plan", cell, "--planner", "straight", "--seed", 4, "--json").result["instance"] == "pair/4"
    mmp("plan", cell, "--planner", "straight", "--seed", 5, "--task", "reach")
    first, again, other = (run["problem"].start["left"] for run in stand_ins.Straight.calls)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_options_reach_problem_and_planner(mmp, stand_ins, instances):
    settings = ["--set", "steps=7", "--set", "w=2", "--set", "careful=off", "--set", "word=1e-3x"]
    mmp("plan", instances, "--planner", "straight", "--seed", 9, "--time-limit", 2.5, "--margin", 0.0005, *settings)
    run = stand_ins.Straight.calls[0]
    assert run["options"] == stand_ins.Straight(steps=7, w=2.0, careful=False, word="1e-3x")
    assert (run["seed"], run["time_limit"], run["problem"].margin) == (9, 2.5, 0.0005)


def test_json_is_one_object_with_the_fields_of_a_result_line(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "straight", "--json", "--out", tmp_path / "plan.json")
    assert list(ran.result) == [*LINE, "valid"]
    assert ran.result["status"] == "solved"
    assert ran.result["valid"] is True
    assert ran.result["cost_rad"] == pytest.approx(1.0)
    assert ran.result["cost_lower_bound_rad"] == pytest.approx(1.0)
    assert ran.result["makespan_s"] == pytest.approx(0.5 / 0.8 * 1.01)
    assert ran.result["min_clearance_m"] > 0
    assert ran.result["expanded_nodes"] == 1
    assert ran.result["low_level_calls"] is None
    assert ran.result["plan"] == str(tmp_path / "plan.json")


def test_json_with_execute_has_the_report_without_recorded_arrays(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "straight", "--json", "--execute")
    assert ran.code == 0
    assert list(ran.result) == [*LINE, "valid", "retimed", "execution"]
    assert ran.result["execution"]["reached"] is True
    assert ran.result["execution"]["contacts"] == []
    assert ran.result["execution"]["max_tracking_error_rad"] < 0.02
    assert not {"times", "positions"} & ran.result["execution"].keys()


def test_contact_in_the_execution_is_exit_1(mmp, stand_ins, tmp_path):
    data = bad_files.good_instances()
    block = {"name": "block", "shape": "box", "position": [-1.3, -0.1, 0.5], "size": [0.2, 0.2, 0.2]}
    data["cell"]["obstacles"].append(block)
    for end, turn in (("start", -1.0), ("goal", 1.0)):
        data["instances"][0][end]["left"] = [turn, *tiny_plans.REACHING[1:]]
    path = tmp_path / "blocked.json"
    path.write_text(json.dumps(data))
    ran = mmp("plan", path, "--planner", "straight", "--json", "--execute")
    assert ran.code == 1
    assert ran.result["valid"] is False
    assert ran.result["execution"]["contacts"]


def test_no_plan_in_time_is_exit_1_and_its_numbers_are_null(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "helpless", "--json", "--execute", "--out", tmp_path / "plan.json")
    assert ran.code == 1
    assert (ran.result["status"], ran.result["expanded_nodes"], ran.result["deadline_hit"]) == ("timeout", 17, True)
    for field in ("valid", "execution", "cost_rad", "makespan_s", "min_clearance_m", "check_time_s", "plan"):
        assert ran.result[field] is None
    assert not (tmp_path / "plan.json").exists()
    out = mmp("plan", instances, "--planner", "helpless").out
    assert "no plan in time" in out
    assert Status.TIMEOUT.advice in " ".join(out.split())


def test_without_a_plan_a_message_names_the_older_files_that_stay(mmp, stand_ins, instances, tmp_path):
    plan, film, picture = tmp_path / "plan.json", tmp_path / "film.gif", tmp_path / "plan.png"
    for path in (plan, film):
        path.write_text("older")
    asked = ["--out", plan, "--video", film, "--image", picture, "--tree", tmp_path / "tree.svg"]
    ran = mmp("plan", instances, "--planner", "helpless", *asked)
    assert ran.code == 1
    assert ran.err.splitlines() == [
        f"mmp: {path} is left as it was; this run wrote nothing to it" for path in (plan, film)
    ]
    assert [path.read_text() for path in (plan, film)] == ["older", "older"]
    assert not picture.exists()


def test_an_invalid_instance_is_exit_2_with_the_reason_and_a_result(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--instance", "outside", "--planner", "straight", "--json")
    assert ran.code == 2
    assert (ran.result["status"], ran.result["instance"]) == ("invalid", "pair/outside")
    assert ran.result["valid"] is None
    assert ran.err.count("\n") == 1
    for words in [str(instances), "instances[1]", "joint 3", "5.5"]:
        assert words in ran.err
    assert stand_ins.Straight.calls == []
    assert mmp("plan", instances, "--instance", "outside").out == ""


def test_a_start_in_collision_is_named_with_the_bodies_in_contact(mmp, tmp_path):
    data = bad_files.good_instances()
    data["instances"][0]["start"]["left"] = [0.0, 1.2, 0.0, 0.0, 0.0, 0.0]
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps(data))
    ran = mmp("plan", path)
    assert ran.code == 2
    for words in [str(path), "instances[0]", "start is in collision: left/", "mm deep"]:
        assert words in ran.err


def test_a_refuted_plan_has_a_loud_message(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "liar", "--json", "--out", tmp_path / "plan.json")
    assert ran.code == 1
    assert ran.result["valid"] is False
    assert "REFUTES" in ran.err
    assert "goal" in mmp("plan", instances, "--planner", "liar").out
    assert mmp("check", tmp_path / "plan.json").code == 1


def test_the_summary_explains_the_seconds_of_the_check(mmp, stand_ins, instances):
    checked = re.compile(r"; checked in \d+\.\d\d s$")
    (line,) = (line for line in mmp("plan", instances, "--planner", "straight").out.splitlines() if "check" in line)
    assert re.match("check +valid; clearance >= ", line)
    assert checked.search(line)
    lines = mmp("plan", instances, "--planner", "liar").out.splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("check"))
    violations = [lines[k], *(line for line in lines[k + 1 :] if line.startswith("  "))]
    assert all(re.match(r"(check)? +[a-z]+: ", line) for line in violations)
    assert checked.search(violations[-1])


def test_an_unwritable_output_is_found_before_planning(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "straight", "--out", tmp_path / "none" / "plan.json")
    assert ran.code == 2
    assert "none/plan.json cannot be written: No such file or directory" in ran.err
    assert stand_ins.Straight.calls == []


def test_without_a_plan_the_summary_says_which_steps_were_not_done(mmp, stand_ins, instances, tmp_path):
    asked = ["--retime", "--execute", "--out", tmp_path / "plan.json"]
    rows = dict(
        line.split(maxsplit=1) for line in mmp("plan", instances, "--planner", "helpless", *asked).out.splitlines()
    )
    assert rows["retiming"] == rows["execution"] == "not done: there is no plan"
    assert rows["plan"] == "file  not written: there is no plan"
    assert rows["margin"] == "2 mm, the default"
    bare = mmp("plan", instances, "--planner", "helpless", "--margin", "arms=0.001").out
    assert "not done" not in bare
    assert "the default" not in bare


def test_a_message_of_20_kilobytes_is_cut(mmp, stand_ins, instances, monkeypatch):
    monkeypatch.setattr(stand_ins.Sorry, "message", "a" * 20_000)
    ran = mmp("plan", instances, "--planner", "sorry", "--json")
    assert re.fullmatch(r"a{900,}\.\.\. \(20000 characters in all\)", ran.result["message"])
    assert len(ran.result["message"]) == 1000
    assert ran.err == f"mmp: {ran.result['message']}\n"


def test_a_planner_that_raises_is_an_error_that_names_it(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "faulty", "--json", "--out", tmp_path / "plan.json")
    assert (ran.code, ran.result["status"], ran.result["valid"]) == (1, "error", None)
    assert list(ran.result) == [*LINE, "valid", "message"]
    assert ran.result["message"].startswith("planner 'faulty' raised RuntimeError: a bug (stand_in_planners.py, line ")
    assert ran.err == f"mmp: {ran.result['message']}\n"
    assert not (tmp_path / "plan.json").exists()
    out = mmp("plan", instances, "--planner", "faulty").out
    assert "error: planner 'faulty' raised RuntimeError: a bug" in out
    assert "certificate included" not in out


def test_an_error_of_the_planner_is_printed_in_its_own_words(mmp, stand_ins, instances):
    ran = mmp("plan", instances, "--planner", "sorry", "--json")
    assert (ran.code, ran.result["message"], ran.err) == (1, "my\nfault", "mmp: my fault\n")


def test_auto_is_the_default_where_it_is_installed(monkeypatch):
    for names, default in ((["apf-ecbs", "auto", "ecbs"], "auto"), (["apf-ecbs", "ecbs"], "apf-ecbs")):
        monkeypatch.setattr(mmp_planners, "names", lambda names=names: names)
        assert default_planner() == default


def test_a_portfolio_names_the_planner_of_the_first_plan(mmp):
    done = mmp("plan", "MultiArmCell-4", "--seed", "3", "--planner", "auto")
    assert done.code == 0
    search = next(line for line in done.out.splitlines() if line.startswith("search"))
    assert "first plan by group-rrt after" in search
    assert "shortcuts" in search
    assert "nodes" not in search  # no tree was grown


def test_given_margins_are_printed_and_proved(mmp, tmp_path):
    out = tmp_path / "plan.json"
    ran = mmp("plan", "MultiArmCell-2", "--seed", 5, "--margin", "arms=0.02,obstacles=0.01", "--out", out, "--json")
    assert ran.code == 0
    assert ran.result["margins_asked"] == {"arms": 0.02, "obstacles": 0.01, "self": None}
    assert ran.result["margins_proved"]["arms"] >= 0.02
    assert ran.result["margins_proved"]["obstacles"] >= 0.01
    assert mmp("check", out).code == 0


def test_the_summary_says_why_the_default_margin_is_less(mmp, tmp_path):
    cell = two_arms.facing_cell()
    near = next(q for q in map(poses, np.linspace(0.0, 0.6, 2000)) if cell.collision.nearest(q)["arms"].clearance_m > 0)
    far = poses(0.8)
    assert cell.collision.nearest(near)["arms"].clearance_m < 0.0025
    ends = [json.dumps({arm: list(row) for arm, row in q.items()}) for q in (near, far)]
    (tmp_path / "facing.json").write_text(json.dumps(cell_to_dict(cell)))
    words = ["plan", tmp_path / "facing.json", "--start", ends[0], "--goal", ends[1]]
    why = "start or goal is tight between arms, where the default is 2 mm"
    assert why in " ".join(mmp(*words).out.split())
    assert "tight" not in mmp(*words[:3], ends[1], "--goal", ends[1]).out
    assert "tight" not in mmp(*words, "--margin", "arms=0.001").out


def poses(pan):
    return {arm: two_arms.reaching(pan) for arm in ("left", "right")}


def test_a_margin_that_cannot_be_kept_is_refused_and_nothing_is_written(mmp, tmp_path):
    ran = mmp("plan", "MultiArmCell-4", "--seed", 3, "--margin", "0.3", "--out", tmp_path / "plan.json")
    assert ran.code == 2
    assert "the largest that would do is" in ran.err
    assert not (tmp_path / "plan.json").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [("arm=0.1", "Did you mean 'arms'"), ("arms=", "above 0"), ("arms=1,arms=2", "twice"), ("self=-1", "above 0")],
)
def test_a_malformed_margin_is_one_sentence(mmp, text, words):
    ran = mmp("plan", "MultiArmCell-2", "--margin", text)
    assert ran.code == 2
    assert words in ran.err
