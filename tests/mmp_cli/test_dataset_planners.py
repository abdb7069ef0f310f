"""`mmp dataset` with planners of another package: each misdeed is the outcome of its instance, and the others go on."""

import json
import textwrap

import pytest

from mmp_cli import planner_process
from mmp_cli.main import main

PLANNER = """
    import math, os, sys, time
    from dataclasses import dataclass

    from mmp_env.errors import MmpError
    from mmp_planners import ignore, make
    from support.stand_in_planners import straight_plan


    def throw(error):
        raise error


    DEEDS = [
        lambda plan: throw(RuntimeError("boom")),
        lambda plan: sys.exit(0),
        lambda plan: None,
        lambda plan: os.kill(os.getpid(), 9),
        lambda plan: throw(MmpError("not today")),
        lambda plan: throw(KeyboardInterrupt),
        lambda plan: throw(RuntimeError("\\ud800" + 5000 * "x")),
        lambda plan: time.sleep(600),
        lambda plan: object.__setattr__(plan.problem, "goal", dict(plan.problem.start)),
    ]


    @dataclass
    class ByTurns:
        def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
            print("a word to the terminal")
            plan = straight_plan(problem, {"name": "by-turns"})
            if seed < len(DEEDS):
                return DEEDS[seed](plan)
            return make("prioritized").plan(problem, seed=seed, time_limit=time_limit)
"""
OUTCOMES = (
    "error: planner 'by-turns' raised RuntimeError: boom (by_turns.py, line ",
    "error: planner 'by-turns' raised SystemExit: 0",
    "error: planner 'by-turns' returned no result: plan() returned nothing (None); it must return a PlanResult",
    "error: planner 'by-turns' gave no answer: its process was killed by SIGKILL",
    "error: planner 'by-turns': not today",
    "error: planner 'by-turns' raised KeyboardInterrupt",
    r"error: planner 'by-turns' raised RuntimeError: \ud800xxx",
    "error: planner 'by-turns' gave no answer: its process was ended, still planning",
    "error: planner 'by-turns' returned no result",
    "success",
)
LONGEST_OUTCOME = 1100


@pytest.fixture
def by_turns(tmp_path, monkeypatch):
    """Installs a planner whose seed says what it does."""
    info = tmp_path / "site" / "by_turns-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: by-turns\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[mmp_env.planners]\nby-turns = by_turns:ByTurns\n")
    (tmp_path / "site" / "by_turns.py").write_text(textwrap.dedent(PLANNER))
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.setattr(planner_process, "GRACE_S", 2.0)


def test_each_misdeed_is_the_outcome_of_its_instance(by_turns, tmp_path, capsys):
    words = ["dataset", "MultiArmCell-2", "--planner", "by-turns", "--time-limit", "0.5", "--json"]
    command = [*words, "--count", str(len(OUTCOMES)), "--out", str(tmp_path / "a")]
    assert main(command) == 0
    ran = capsys.readouterr()
    index = (tmp_path / "a" / "dataset.json").read_text()
    found = [line["outcome"] for line in json.loads(index)["instances"]]
    for outcome, wanted in zip(found, OUTCOMES, strict=True):
        assert outcome.startswith(wanted)
        assert len(outcome) < LONGEST_OUTCOME
    assert (ran.out.count("\n"), json.loads(ran.out)["episodes"]) == (1, 1)
    assert "Traceback" not in ran.err
    assert main(command) == 0, "the outcomes can be read again"
    assert (tmp_path / "a" / "dataset.json").read_text() == index


def test_a_planner_that_does_not_load_ends_the_command_before_it_plans(by_turns, tmp_path, capsys):
    (tmp_path / "site" / "by_turns.py").write_text("import sys\nsys.exit('bye')\n")
    assert main(["dataset", "MultiArmCell-2", "--planner", "by-turns", "--out", str(tmp_path / "a")]) == 2
    error = capsys.readouterr().err
    assert "does not load: SystemExit: bye" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a").exists()


def test_a_planner_of_this_package_that_refuses_one_instance_goes_on_with_the_others(stand_ins, tmp_path, monkeypatch):
    from mmp_env.errors import MmpError

    plan = stand_ins.Straight.plan

    def refuse_one(self, problem, *, seed=0, **options):
        if seed == 0:
            raise MmpError("no")
        return plan(self, problem, seed=seed, **options)

    monkeypatch.setattr(stand_ins.Straight, "plan", refuse_one)
    words = ["dataset", "MultiArmCell-2", "--planner", "straight", "--seed", "0", "--count", "2"]
    main([*words, "--out", str(tmp_path / "a")])
    found = [line["outcome"] for line in json.loads((tmp_path / "a" / "dataset.json").read_text())["instances"]]
    assert found[0] == "error: no"
    assert not found[1].startswith("error")
