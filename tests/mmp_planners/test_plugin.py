"""The plug-in of docs/how-to/add-a-planner.md, built and installed: it is listed, plans, and runs in a benchmark."""

import json
import re

import pytest
from support import plugin_page

from mmp_env import check_plan
from mmp_env.files.plan_file import load_plan, plan_to_dict
from mmp_planners.testing import RULES


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Returns the folder in which the plug-in is installed."""
    return plugin_page.install(tmp_path_factory.mktemp("plugin"))


def test_the_page_shows_a_distribution_of_two_files_and_a_planner_of_some_thirty_lines():
    files = plugin_page.files()
    assert set(files) == {"pyproject.toml", "mmp_turns.py"}
    _, _, planner = files["mmp_turns.py"].partition("@dataclass")
    assert len(planner.splitlines()) <= 35


def test_it_is_listed_with_its_options_beside_the_others(site):
    ran = plugin_page.mmp(site, "list", "--json")
    assert ran.returncode == 0, ran.stderr
    planners = {planner["name"]: planner for planner in json.loads(ran.stdout)["planners"]}
    assert {"ecbs", "apf-ecbs"} <= planners.keys()
    assert [option["name"] for option in planners["turns"]["options"]] == ["detours", "patience"]
    assert all(option["doc"] for option in planners["turns"]["options"])


def test_it_plans_by_name_with_options_and_the_plan_knows_by_whom_it_was_made(site, tmp_path):
    out = tmp_path / "plan.json"
    options = ["--planner", "turns", "--seed", 1, "--set", "detours=0.5", "--execute", "--json", "--out", out]
    ran = plugin_page.mmp(site, "plan", "MultiArmCell-2", *options)
    assert ran.returncode == 0, ran.stderr
    line = json.loads(ran.stdout.splitlines()[-1])
    assert (line["status"], line["valid"], line["planner"], line["deadline_hit"]) == ("solved", True, "turns", False)
    assert line["execution"]["reached"] is True
    plan = load_plan(out)
    assert plan.planner == {"name": "turns", "options": {"detours": 0.5, "patience": 100}, "seed": 1}
    assert check_plan(plan_to_dict(plan), exact=True).valid


def test_it_is_benchmarked_beside_another(site, tmp_path):
    words = ["--planners", "turns,ecbs", "--count", 2, "--workers", 1, "--out", tmp_path / "out"]
    ran = plugin_page.mmp(site, "bench", "MultiArmCell-2", *words)
    assert ran.returncode == 0, ran.stderr
    lines = [json.loads(line) for line in (tmp_path / "out" / "results.jsonl").read_text().splitlines()]
    assert sorted(line["planner"] for line in lines) == ["ecbs", "ecbs", "turns", "turns"]
    assert {line["status"] for line in lines} == {"solved"}


def test_it_keeps_the_contract_in_the_words_of_the_page(site):
    (test,) = re.findall(
        r"^```python\n(from mmp_planners\.testing .*?)^```$", plugin_page.PAGE, re.DOTALL | re.MULTILINE
    )
    ran = plugin_page.python(site, test + "\ntest_my_planner_keeps_the_contract()")
    assert ran.returncode == 0, ran.stderr


def test_the_page_names_every_rule_of_the_contract():
    stated = re.findall(r"^\| (.*?) \|", plugin_page.PAGE.replace("`", ""), re.MULTILINE)
    assert [rule for rule in stated if rule in RULES] == list(RULES)
