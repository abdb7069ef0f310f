import json
import re

from support import bad_files


def test_a_valid_plan_is_one_line_with_the_proved_clearance(mmp, plan):
    ran = mmp("check", plan)
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith(f"{plan}: valid; clearance >= ")
    assert ran.out.count("\n") == 1


def test_each_margin_is_printed_with_its_proved_clearance(mmp, tmp_path):
    equal, each = tmp_path / "equal.json", tmp_path / "each.json"
    words = ["plan", "MultiArmCell-2", "--planner", "ecbs", "--seed", 3, "--out"]
    assert mmp(*words, equal).code == 0
    assert mmp(*words, each, "--margin", "arms=0.02,obstacles=0.01").code == 0
    number = r"[\d.]+ mm"
    kinds = f"{number} between arms, {number} to obstacles, {number} between parts of one arm"
    assert re.search(f"; margin 2 mm, proved {kinds}$", mmp("check", equal).out.strip())
    asked = "margin 20 mm between arms, 10 mm to obstacles, 2 mm between parts of one arm"
    assert re.search(f"clearance at every instant >= {kinds}; {asked}$", mmp("check", each).out.strip())


def test_the_exact_check_measures_the_mujoco_geoms(mmp, plan):
    spheres, geoms = (mmp("check", plan, "--json", *more).result for more in ([], ["--exact"]))
    assert (spheres["exact"], geoms["exact"]) == (False, True)
    assert geoms["spheres"] == "geoms"
    assert geoms["min_clearance_m"] > spheres["min_clearance_m"]


def test_a_wrong_plan_is_exit_1_with_every_violation(mmp, plan):
    data = bad_files.good_plan()
    data["problem"]["start"]["left"][0] += 0.1
    data["problem"]["goal"]["right"][0] += 0.1
    data["positions"]["left"][1][2] = 3.2
    plan.write_text(json.dumps(data))
    ran = mmp("check", plan)
    assert ran.code == 1
    title, *violations = ran.out.splitlines()
    assert title == f"{plan}: {len(violations)} violations"
    for rule in ("start", "goal", "limits"):
        assert any(line.startswith(f"  {rule}: ") for line in violations)


def test_json_has_a_line_for_each_plan(mmp, plan, tmp_path):
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps(bad_files.spoilt(bad_files.good_plan(), ["times", 0], 0.5)))
    ran = mmp("check", plan, wrong, "--json")
    assert ran.code == 1
    one, other = map(json.loads, ran.out.splitlines())
    assert (one["plan"], one["valid"], one["violations"]) == (str(plan), True, [])
    assert (other["plan"], other["valid"]) == (str(wrong), False)
    assert "times" in [violation["rule"] for violation in other["violations"]]


def test_an_unreadable_plan_does_not_stop_the_check_of_the_others(mmp, plan, tmp_path):
    torn = tmp_path / "torn.json"
    torn.write_text(plan.read_text()[:100])
    ran = mmp("check", torn, plan)
    assert ran.code == 2
    assert ran.err.startswith(f"mmp: {torn} is not JSON")
    assert ran.out.startswith(f"{plan}: valid")


def test_the_checker_reads_the_file_itself(mmp, plan, monkeypatch):
    given = []

    def check(data, *, exact):
        given.append(data)
        return real(data, exact=exact)

    import mmp_env.check

    real = mmp_env.check.check_document
    monkeypatch.setattr(mmp_env.check, "check_document", check)
    assert mmp("check", plan).code == 0
    assert given == [json.loads(plan.read_text())]


def test_an_episode_is_checked_plan_by_plan_and_at_its_seams(mmp, tmp_path):
    good = bad_files.good_plan()
    back = bad_files.good_plan()
    back["positions"] = {name: rows[::-1] for name, rows in back["positions"].items()}
    back["problem"]["start"], back["problem"]["goal"] = back["problem"]["goal"], back["problem"]["start"]
    path = tmp_path / "episode.json"
    for plans, code in (([good, back], 0), ([good, good], 1)):
        path.write_text(json.dumps({"schema": "mmp-episode/1", "plans": plans}))
        ran = mmp("check", path)
        assert (ran.code, ran.err) == (code, "")
        assert ("does not go on from plan 0" in ran.out) == bool(code)
        title, *lines = ran.out.splitlines()
        assert title == f"{path}: " + (f"{len(lines)} violations" if code else "valid")
        assert all(line.startswith(("  plan ", "  start: ")) for line in lines)
        assert mmp("check", path, "--json").result["valid"] == (not code)


def test_infinite_values_are_null_in_json(mmp, plan):
    data = bad_files.good_plan()
    data["times"][1] = 5e-324
    plan.write_text(json.dumps(data))
    ran = mmp("check", plan, "--json")
    assert (ran.code, ran.err) == (1, "")
    assert "Infinity" not in ran.out
    assert None in [violation["values"].get("value", 0.0) for violation in ran.result["violations"]]


def test_an_enormous_number_is_printed_with_few_digits(mmp, plan):
    data = bad_files.good_plan()
    data["positions"]["left"][1][0] = 1e308
    plan.write_text(json.dumps(data))
    ran = mmp("check", plan)
    assert ran.code == 1
    assert "joint 1, is at 1e+308 rad; allowed: -6.28" in ran.out
    assert max(map(len, ran.out.splitlines())) < 200
