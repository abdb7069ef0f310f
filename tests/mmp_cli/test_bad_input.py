import json

import pytest
from support import bad_files
from support.refusals import assert_refused

from mmp_env.files.plan_file import load_plan

ENDS = json.dumps({"left": bad_files.TUCKED, "right": bad_files.TUCKED})

DEGREES = json.dumps({"left": [149.3, -126.0, 143.2, -107.1, -90.0, 0.0], "right": bad_files.TUCKED})


@pytest.mark.parametrize("case", bad_files.CELLS)
def test_a_bad_cell_file(mmp, tmp_path, case):
    where, value, words = bad_files.CELLS[case]
    path = tmp_path / "cell.json"
    path.write_text(bad_files.text(bad_files.spoilt(bad_files.good_cell(), where, value)))
    assert_refused(mmp("plan", path, "--json"), str(path), *words)


@pytest.mark.parametrize("case", bad_files.INSTANCES)
def test_a_bad_instance_file(mmp, tmp_path, case):
    where, value, words = bad_files.INSTANCES[case]
    data = bad_files.spoilt(bad_files.good_instances(), where, value)
    path = tmp_path / "instances.json"
    path.write_text(bad_files.text(data))
    assert_refused(mmp("plan", path, "--json"), str(path), *words)


@pytest.mark.parametrize("case", bad_files.PLANS)
def test_a_bad_plan_file(mmp, tmp_path, case):
    where, value, words = bad_files.PLANS[case]
    path = tmp_path / "plan.json"
    path.write_text(bad_files.text(bad_files.spoilt(bad_files.good_plan(), where, value)))
    assert_refused(mmp("check", path, "--json"), str(path), *words)


@pytest.mark.parametrize("command", ["plan", "check"])
@pytest.mark.parametrize("case", bad_files.TEXTS)
def test_a_file_that_is_no_json_object(mmp, tmp_path, command, case):
    content, words = bad_files.TEXTS[case]
    path = tmp_path / "file.json"
    path.write_bytes(content)
    assert_refused(mmp(command, path), str(path), *words)


@pytest.mark.parametrize("case", bad_files.YAML_TEXTS)
def test_a_file_that_is_no_yaml_object(mmp, tmp_path, case):
    content, words = bad_files.YAML_TEXTS[case]
    path = tmp_path / "file.yaml"
    path.write_bytes(content)
    assert_refused(mmp("plan", path), str(path), *words)


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["plam"], ["unknown command 'plam'", "Did you mean 'plan'?", "check, dataset, export, list, plan"]),
        (["plan"], ["SOURCE"]),
        (["check"], ["PLAN"]),
        (["plan", "MultiArmCel-8"], ["'MultiArmCel-8'", "Did you mean 'MultiArmCell-8'?", "MultiArmCell-2"]),
        (["plan", "MultiArmCell-7"], ["'MultiArmCell-7'", "MultiArmCell-8"]),
        (["plan", "MultiArmCell"], ["no cell of its own", "MultiArmCell-8"]),
        (["plan", "none.json"], ["none.json cannot be read: No such file"]),
        (["plan", "."], [". cannot be read: Is a directory"]),
        (["check", "none.json"], ["none.json cannot be read: No such file"]),
        (["plan", "MultiArmCell-2", "--robot", "ur5"], ["unknown robot 'ur5'", "Did you mean 'ur5e'?", "fr5, panda"]),
        (["plan", "MultiArmCell-2", "--task", "raech"], ["unknown task 'raech'", "Did you mean 'reach'?"]),
        (["plan", "MultiArmCell-2", "--planner", "apf-ecsb"], ["unknown planner", "Did you mean 'apf-ecbs'?", "ecbs"]),
        (["plan", "MultiArmCell-2", "--planner", "absent"], ["'absent'", "no_such_package"]),
        (["plan", "MultiArmCell-2", "--plan", "ecbs"], ["'--plan'", "Did you mean '--planner'?", "--time-limit"]),
        (["plan", "MultiArmCell-2", "--smooth"], ["unknown option", "'--smooth'"]),
        (["plan", "MultiArmCell-2", "twice"], ["no use for the argument 'twice'"]),
        (["list", "--jsn"], ["'--jsn'", "Did you mean '--json'?"]),
        (["plan", "MultiArmCell-2", "--seed", "-1"], ["mmp: argument --seed: '-1'", "whole number from 0"]),
        (["plan", "MultiArmCell-2", "--seed", "1.5"], ["--seed", "'1.5'", "whole number from 0"]),
        (["plan", "MultiArmCell-2", "--seed", "9" * 40], ["--seed", "whole number from 0"]),
        (["plan", "MultiArmCell-2", "--seed"], ["--seed", "expected one argument"]),
        (["plan", "MultiArmCell-2", "--time-limit", "0"], ["--time-limit", "'0'", "above 0"]),
        (["plan", "MultiArmCell-2", "--time-limit", "nan"], ["--time-limit", "'nan'", "above 0"]),
        (["plan", "MultiArmCell-2", "--time-limit", "long"], ["--time-limit", "'long'", "above 0"]),
        (["plan", "MultiArmCell-2", "--margin", "-0.1"], ["--margin", "'-0.1'", "above 0"]),
        (["plan", "MultiArmCell-2", "--margin", "5mm"], ["'5mm'", "metres", "arms=A,obstacles=B,self=C"]),
        (["plan", "MultiArmCell-2", "--margin", "0,05"], ["'0,05'", "metres", "such as 0.005"]),
        (["plan", "MultiArmCell-2", "--margin", "arms:0.05"], ["'arms:0.05'", "arms=A,obstacles=B,self=C"]),
        (["plan", "MultiArmCell-2", "--margin", "arms=0,05"], ["'arms=0,05'", "metres"]),
        (["plan", "MultiArmCell-2", "--margin", "arm-s=0.05"], ["unknown margin 'arm-s'. Did you mean 'arms'?"]),
        (["plan", "MultiArmCell-2", "--margin", "1e9"], ["--margin: margin between arms is", "at most"]),
        (["plan", "MultiArmCell-2", "--planner", "ECBS"], ["unknown planner 'ECBS'. Did you mean 'ecbs'?"]),
        (["plan", "MultiArmCell-2", "--margin", "inf"], ["--margin", "'inf'", "finite"]),
        (["plan", "MultiArmCell-2", "--planner", "straight", "--set", "setps=3"], ["'setps'", "'steps'", "careful"]),
        (["plan", "MultiArmCell-2", "--planner", "straight", "--set", "steps=x"], ["'steps'", "'x'", "an integer"]),
        (
            ["plan", "MultiArmCell-2", "--planner", "straight", "--set", "careful=3"],
            ["'careful'", "3", "true or false"],
        ),
        (["plan", "MultiArmCell-2", "--planner", "straight", "--set", "w=NaN"], ["'w'", "'NaN'", "a number"]),
        (["plan", "MultiArmCell-2", "--planner", "straight", "--set", f"w=1{400 * '0'}"], ["'w'", "a number up to"]),
        (["plan", "MultiArmCell-2", "--planner", "straight", "--set", "steps"], ["--set", "'steps'", "key=value"]),
        (["plan", "MultiArmCell-2", "--set", "w=1", "--set", "w=2"], ["w twice", "1", "2"]),
        (["plan", "MultiArmCell-2", "--instance", "a"], ["--instance", "'a'", "environment id"]),
        (["plan", "MultiArmCell-2", "--start", ENDS], ["--goal is missing"]),
        (["plan", "{instances}", "--robot", "ur5e"], ["--robot", "'ur5e'", "instance file"]),
        (["plan", "{instances}", "--task", "reach"], ["--task", "'reach'", "instance file"]),
        (["plan", "{instances}", "--start", ENDS, "--goal", ENDS], ["--start", "instance file"]),
        (["plan", "{instances}", "--instance", "tunr"], ["'tunr'", "Did you mean 'turn'?", "outside"]),
        (["plan", "{cell}", "--instance", "turn"], ["--instance", "cell file"]),
        (["plan", "{cell}", "--robot", "panda"], ["--robot", "cell file"]),
        (["plan", "{cell}", "--task", "reach", "--start", ENDS, "--goal", ENDS], ["--task", "drawn or given"]),
        (["plan", "{cell}", "--start", "{", "--goal", ENDS], ["--start is not JSON"]),
        (["plan", "{cell}", "--start", "[1]", "--goal", ENDS], ["--start is [1]", "object"]),
        (["plan", "{cell}", "--start", '{"left": [0]}', "--goal", ENDS], ["--start has no arm 'right'"]),
        (
            ["plan", "{cell}", "--start", ENDS, "--goal", '{"left": [0], "right": [0]}'],
            ["--goal: left has 1 numbers", "6"],
        ),
        (["plan", "{cell}", "--start", ENDS, "--goal", DEGREES], ["goal of arm 'left'", "149.3 looks like degrees"]),
        (["plan", "{instances}", "--out", "."], [". cannot be written: it is not a regular file"]),
        (["plan", ""], ["argument SOURCE is empty; give a value"]),
        (
            ["plan", "{instances}", "--out", "p.csv"],
            ["'p.csv' would be a plan file", "mmp export plan.json --to p.csv"],
        ),
        (["plan", "{instances}", "--out", "a/p.yml"], ["'a/p.yml'", "`mmp export plan.json --to a/p.yaml`"]),
        (["plan", "{instances}", "--out", "-"], ["argument --out: '-' does not stand for standard output"]),
        (["bench", "{instances}", "--out", "-"], ["argument --out: '-' does not stand for standard output"]),
        (["plan", "{instances}", "--out", ""], ["argument --out is empty; give a value"]),
        (["check", "none.json", ""], ["argument PLAN is empty; give a value"]),
        (["list", "--json=yes"], ["argument --json: it takes no value, not 'yes'"]),
    ],
    ids=lambda value: " ".join(value)[:60] if value and value[0] in ("plan", "bench", "check", "list", "plam") else "",
)
def test_bad_usage(mmp, stand_ins, instances, cell, argv, words):
    places = {"{instances}": instances, "{cell}": cell}
    assert_refused(mmp(*(places.get(word, word) for word in argv)), *words)


@pytest.mark.parametrize(
    "argv",
    [
        ["plan", "MultiArmCell-4", "--margin", "arms=0.05", "--margin", "self=0.003"],
        ["plan", "MultiArmCell-4", "--planner=ecbs", "--seed", "1", "--planner", "ecbs"],
        ["plan", "MultiArmCell-4", "--moments", "end", "--moments", "start"],
        ["bench", "MultiArmCell-4", "--planners", "ecbs", "MultiArmCell-2", "--planners", "cbs"],
        ["report", "bench", "--against-note", "C++", "--against", "a", "--against", "b", "--against-note", "60 s"],
        ["export", "plan.json", "--to", "a.csv", "--to", "b.csv"],
        ["show", "plan.json", "--image", "a.png", "--image", "b.png"],
    ],
    ids=lambda argv: " ".join(argv[:2]),
)
def test_an_option_of_one_value_that_is_given_twice(mmp, argv):
    option = next(word for word in reversed(argv) if word.startswith("--"))
    assert_refused(mmp(*argv), f"{option} is given twice; give it once")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, ["cannot be read: No such file"]),
        ("{", ["ends.json is not JSON", "line 1"]),
        ("[1]", ["ends.json is [1]", "arm name -> configuration"]),
        ('{"left": [0, 0, 0]}', ["ends.json: left has 3 numbers"]),
        ('{"left": [0, 0, NaN, 0, 0, 0], "right": []}', ["ends.json: left[2] is nan", "a finite number"]),
        ('{"lefty": []}', ["ends.json: unknown arm 'lefty'. Did you mean 'left'?"]),
        (json.dumps(bad_files.good_instances()), ["ends.json is an instance file; --goal takes"]),
        (json.dumps(bad_files.good_plan()), ["ends.json is a plan; --goal takes"]),
    ],
)
def test_a_goal_from_a_file_is_refused_with_file_and_place(mmp, tmp_path, cell, content, words):
    path = tmp_path / "ends.json"
    if content is not None:
        path.write_text(content)
    assert_refused(mmp("plan", cell, "--start", ENDS, "--goal", f"@{path}"), str(path), *words)


def test_a_start_that_names_a_file_without_at_sign_gets_a_hint(mmp, cell):
    ran = mmp("plan", cell, "--start", "ends.json", "--goal", ENDS)
    assert_refused(ran, "--start is not JSON", "--start @ends.json")
    torn = mmp("plan", cell, "--start", '{"a/b": [', "--goal", ENDS)
    assert_refused(torn, "--start is not JSON")
    assert "@" not in torn.err
    assert_refused(mmp("plan", cell, "--start", "@", "--goal", ENDS), "--start is '@'", "@FILE")


@pytest.mark.parametrize("option", ["--out", "--tree", "--rerun", "--image", "--video"])
def test_the_files_of_start_and_goal_are_not_overwritten(mmp, tmp_path, cell, option):
    path = tmp_path / "ends.json"
    path.write_text(ENDS)
    ran = mmp("plan", cell, "--start", ENDS, "--goal", f"@{path}", option, path)
    assert_refused(ran, f"{option} would overwrite", "ends.json itself")
    assert path.read_text() == ENDS


@pytest.mark.parametrize("option", ["--out", "--tree", "--rerun", "--image", "--video"])
def test_the_source_itself_is_not_overwritten(mmp, instances, option):
    assert_refused(mmp("plan", instances, option, instances), f"{option} would overwrite", "pairs.json itself")


def test_a_file_may_have_the_name_of_an_environment(mmp, stand_ins, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mmp("plan", "MultiArmCell-2", "--planner", "straight", "--out", "MultiArmCell-2")
    assert load_plan("MultiArmCell-2").problem.name == "MultiArmCell-2/0"


@pytest.mark.parametrize("command", ["plan", "bench"])
@pytest.mark.parametrize("stem", ["a" * 150, "two\nlines", "\x1b[31mred", "caf\udce9"])
def test_a_cell_file_whose_name_is_no_cell_name_is_refused(mmp, tmp_path, command, stem):
    path, out = tmp_path / f"{stem}.yaml", tmp_path / "out"
    path.write_text(json.dumps(bad_files.spoilt(bad_files.good_cell(), ["name"], bad_files.GONE)))
    assert_refused(mmp(command, path, "--out", out), "name is missing", "the file's own name", "cannot stand in for it")
    assert not out.exists()


def test_bad_usage_is_refused_before_planning(mmp, stand_ins, instances):
    assert_refused(mmp("plan", instances, "--planner", "straight", "--set", "setps=3", "--json"), "'setps'")
    assert stand_ins.Straight.calls == []


def test_control_characters_of_a_file_do_not_reach_the_terminal(mmp, tmp_path):
    path = tmp_path / "cell.json"
    path.write_text('{"arms": [], "\\u001b[31mred\\nline": 1}')
    ran = mmp("plan", path)
    assert_refused(ran, "unknown field")
    assert "\x1b" not in ran.err
