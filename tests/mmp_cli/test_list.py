import json
import sys
import time

import gymnasium
import pytest
from support import bench_runs

from mmp_cli import child_call
from mmp_env.errors import MmpError
from mmp_env.robot_folders import robot_names


def test_robots_cells_tasks_and_planners_are_listed(mmp, stand_ins):
    ran = mmp("list")
    assert ran.code == 0
    for name in [*robot_names(), "MultiArmCell-8", "reach", "ecbs", "apf-ecbs-nf", "apf-ecbs", "straight"]:
        assert f"  {name} " in ran.out
    assert "pieces of the line" in ran.out
    assert all(line == line.rstrip() for line in ran.out.splitlines())


def test_json_has_the_options_with_types_and_defaults(mmp, stand_ins):
    found = mmp("list", "--json").result
    assert list(found) == ["robots", "tools", "cells", "tasks", "planners"]
    (straight,) = [planner for planner in found["planners"] if planner["name"] == "straight"]
    assert straight["summary"] == "Goes straight, through every obstacle."
    assert straight["options"][0] == {"name": "steps", "type": "int", "default": 4, "doc": "pieces of the line"}
    (panda,) = [robot for robot in found["robots"] if robot["name"] == "panda"]
    assert (panda["joints"], panda["tool"]) == (7, "franka-hand")


def test_the_cells_are_the_environments_that_gymnasium_knows(mmp):
    found = {cell["name"] for cell in mmp("list", "--json").result["cells"]}
    known = {name for name in gymnasium.registry if str(name).startswith("MultiArmCell-")}
    assert found == known


def test_a_planner_that_does_not_load_is_named_and_harms_no_other(mmp, stand_ins):
    ran = mmp("list")
    assert ran.code == 0
    (line,) = [line for line in ran.out.splitlines() if line.startswith("  absent ")]
    assert "no_such_package" in line
    (absent,) = [one for one in mmp("list", "--json").result["planners"] if one["name"] == "absent"]
    assert "no_such_package" in absent["error"]
    assert json.dumps(absent)


def test_planners_of_other_packages_are_not_imported_by_the_program(mmp, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    before = set(sys.modules)
    ran = mmp("list", "--json")
    assert (ran.code, ran.err) == (0, "")
    found = {planner["name"]: planner for planner in ran.result["planners"]}
    assert found["quick"]["summary"] == "Goes straight, and keeps no state."
    assert found["gone"]["error"] == "its process ended with exit code 0"
    assert found["deadly"]["error"] == "its process was killed by SIGSEGV (it crashed)"
    assert "SystemExit: bye" in found["leaving"]["error"]
    assert "no_such_package" in found["absent"]["error"]
    assert not {"deadly_import", "leaving_import", "gone_import"} & (set(sys.modules) - before)


def test_an_answer_that_never_comes_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(child_call, "LIMIT_S", 0.05)
    with pytest.raises(MmpError, match="did not answer within"):
        child_call.call_in_child(lambda _: time.sleep(60), "")
