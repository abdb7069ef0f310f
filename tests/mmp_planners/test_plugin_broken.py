"""Broken plug-ins: messages name each fault, and other planners keep working."""

import json

import pytest
from support import plugin_page

MODULE = """
import sys
import numpy as np
from mmp_env.model.plan import Plan
from mmp_env.errors import MmpError
from mmp_planners import PlanResult, Status, ignore

class Planner:
    def plan(self, problem, *, seed=0, time_limit=1.0, watch=ignore):
        return self.result(problem)

def straight(problem, last=1.0):
    positions = {a: np.array([q, q + last * (problem.goal[a] - q)]) for a, q in problem.start.items()}
    return Plan(problem=problem, times=np.array([0.0, 100.0]), positions=positions)

class OtherArguments:
    def plan(self, problem, deadline):
        pass

class NoPlan:
    pass

class Demanding(Planner):
    def __init__(self, table):
        pass

class Raises(Planner):
    def result(self, problem):
        raise RuntimeError("no more\\nideas")

class Exits(Planner):
    def result(self, problem):
        sys.exit("enough")

class Misused(Planner):
    def result(self, problem):
        raise MmpError("too many arms")

class Nothing(Planner):
    def result(self, problem):
        return None

class Number(Planner):
    def result(self, problem):
        return 42

class PlanAlone(Planner):
    def result(self, problem):
        return straight(problem)

class Unplanned(Planner):
    def result(self, problem):
        return PlanResult(status=Status.SOLVED)

class Undecided(Planner):
    def result(self, problem):
        return PlanResult(status=Status.TIMEOUT, plan=straight(problem))

class Finished(Planner):
    def result(self, problem):
        return PlanResult(status="finished")

class Text(Planner):
    def result(self, problem):
        return PlanResult(status=Status.SOLVED, plan="left, then right")

class OneArm(Planner):
    def result(self, problem):
        plan = straight(problem)
        return PlanResult(status=Status.SOLVED, plan=Plan(problem=problem, times=plan.times, positions={}))

class OneRow(Planner):
    def result(self, problem):
        plan = straight(problem)
        rows = {a: q[:1] for a, q in plan.positions.items()}
        return PlanResult(status=Status.SOLVED, plan=Plan(problem=problem, times=plan.times, positions=rows))

class Timeless(Planner):
    def result(self, problem):
        plan = straight(problem)
        return PlanResult(status=Status.SOLVED, plan=Plan(problem=problem, times=None, positions=plan.positions))

class Boastful(Planner):
    def result(self, problem):
        return PlanResult(status=Status.TIMEOUT, stats={"expanded_nodes": "many"})

class Short(Planner):
    def result(self, problem):
        return PlanResult(status=Status.SOLVED, plan=straight(problem, 0.5))
"""

UNLOADABLE = {
    "absent": ("no_such_package:Planner", "does not load: ModuleNotFoundError: No module named 'no_such_package'"),
    "leaving": ("mmp_leaving:Planner", "does not load: SystemExit: not today"),
    "unknown": ("mmp_broken:Nobody", "does not load: AttributeError"),
    "value": ("mmp_broken:MODULE", "is no class but a str"),
    "no-plan": ("mmp_broken:NoPlan", "has no method plan"),
    "other-arguments": (
        "mmp_broken:OtherArguments",
        "has plan(self, problem, deadline), not plan(self, problem, *, seed",
    ),
}
"""Planner -> its entry point, and its message."""

UNUSABLE = {
    "demanding": ("mmp_broken:Demanding", "cannot be made: TypeError"),
    "misused": ("mmp_broken:Misused", "'misused': too many arms"),
}

FAILING = {
    "raises": ("mmp_broken:Raises", "raised RuntimeError: no more ideas (mmp_broken.py, line"),
    "exits": ("mmp_broken:Exits", "raised SystemExit: enough"),
    "nothing": ("mmp_broken:Nothing", "plan() returned nothing (None)"),
    "number": ("mmp_broken:Number", "plan() returned of type int"),
    "plan-alone": ("mmp_broken:PlanAlone", "plan() returned of type Plan; it must return a PlanResult"),
    "unplanned": ("mmp_broken:Unplanned", "the status is solved without a plan"),
    "undecided": ("mmp_broken:Undecided", "the status is timeout with a plan"),
    "finished": ("mmp_broken:Finished", "the status is 'finished'; it must be one of solved"),
    "text": ("mmp_broken:Text", "the plan is of type str; it must be a Plan"),
    "one-arm": ("mmp_broken:OneArm", "the plan has no positions of arm 'arm0'"),
    "one-row": ("mmp_broken:OneRow", "the positions of arm 'arm0' have the shape [1, 6], not [2, 6]"),
    "timeless": ("mmp_broken:Timeless", "the plan holds null where numbers are wanted"),
    "boastful": ("mmp_broken:Boastful", "expanded_nodes is 'many'; it must be a number"),
}

ALL = UNLOADABLE | UNUSABLE | FAILING | {"short": ("mmp_broken:Short", "goal")}

EACH = """
import contextlib, io, json, sys
from mmp_cli.main import main
for name in sys.argv[1:]:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(["plan", "MultiArmCell-2", "--planner", name, "--json"])
    print(json.dumps([name, code, out.getvalue(), err.getvalue()]))
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Returns the folder in which the broken plug-ins are installed."""
    site = tmp_path_factory.mktemp("broken")
    (site / "mmp_broken.py").write_text(MODULE + 'MODULE = "no planner"\n')
    (site / "mmp_leaving.py").write_text("raise SystemExit('not today')\n")
    plugin_page.register(site, {name: where for name, (where, _) in ALL.items()})
    return site


@pytest.fixture(scope="module")
def planned(site):
    """Returns planner -> exit code, stdout and stderr of `mmp plan`, all from one process."""
    ran = plugin_page.python(site, EACH, *ALL, "ecbs")
    assert ran.returncode == 0, ran.stderr
    return {name: rest for name, *rest in map(json.loads, ran.stdout.splitlines())}


def test_all_others_are_listed_and_what_does_not_load_says_so_in_its_place(site):
    ran = plugin_page.mmp(site, "list", "--json")
    assert ran.returncode == 0, ran.stderr
    planners = {planner["name"]: planner for planner in json.loads(ran.stdout)["planners"]}
    assert {"ecbs", "apf-ecbs", *ALL} <= planners.keys()
    assert {name for name, planner in planners.items() if "error" in planner} == UNLOADABLE.keys()
    for name, (_, words) in UNLOADABLE.items():
        assert f"planner '{name}'" in planners[name]["error"]
        assert words in planners[name]["error"]


@pytest.mark.parametrize("name", [*UNLOADABLE, *UNUSABLE])
def test_a_planner_that_cannot_be_used_is_one_sentence_and_exit_2(name, planned):
    code, out, err = planned[name]
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"planner '{name}'" in err
    assert ALL[name][1] in err


@pytest.mark.parametrize("name", FAILING)
def test_a_planner_that_fails_is_an_error_in_one_sentence_and_exit_1(name, planned):
    code, out, err = planned[name]
    assert (code, err.count("\n")) == (1, 1)
    assert err.startswith(f"mmp: planner '{name}' ")
    assert ALL[name][1] in err
    line = json.loads(out)
    assert (line["status"], line["valid"], line["plan"], line["cost_rad"]) == ("error", None, None, None)
    assert f"planner '{name}' " in line["message"]


def test_a_plan_that_is_wrong_is_refuted_loudly(planned):
    code, out, err = planned["short"]
    line = json.loads(out)
    assert (code, line["status"], line["valid"]) == (1, "solved", False)
    assert "THE CHECKER REFUTES THIS PLAN, which short returned" in err


def test_after_all_of_them_a_sound_planner_plans_as_ever(planned):
    code, out, _ = planned["ecbs"]
    assert (code, json.loads(out)["valid"]) == (0, True)


def test_the_summary_for_people_says_what_went_wrong(site):
    ran = plugin_page.mmp(site, "plan", "MultiArmCell-2", "--planner", "raises")
    assert ran.returncode == 1
    assert "error: planner 'raises' raised RuntimeError: no more ideas" in ran.stdout
    assert "Traceback" not in ran.stderr


def test_a_benchmark_goes_on_and_names_them(site, tmp_path):
    words = ["--planners", "ecbs,raises,absent,nothing", "--count", 1, "--workers", 1, "--out", tmp_path / "out"]
    ran = plugin_page.mmp(site, "bench", "MultiArmCell-2", *words)
    assert ran.returncode == 0, ran.stderr
    lines = [json.loads(line) for line in (tmp_path / "out" / "results.jsonl").read_text().splitlines()]
    statuses = {line["planner"]: (line["status"], line["message"]) for line in lines}
    assert statuses["ecbs"] == ("solved", None)
    for name, words in {"raises": "no more ideas", "absent": "no_such_package", "nothing": "nothing"}.items():
        status, message = statuses[name]
        assert status == "error"
        assert words in message
