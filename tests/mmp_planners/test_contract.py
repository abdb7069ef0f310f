"""The contract of every registered planner, and further guarantees of the built-in planners."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import two_arms

from mmp_env import check_plan, core
from mmp_env.errors import MmpError
from mmp_env.events import Event, SolutionFound
from mmp_env.files.plan_file import save_plan
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners import Planner, PlanResult, Status, StopPlanning, describe, make, names
from mmp_planners.registry import load
from mmp_planners.testing import RULES, check_planner
from mmp_planners.tree_planner import TreePlanner

TESTS = Path(__file__).parents[1]
COUNTS = {"expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits"}
OWNED = COUNTS | {"root_conflicts", "cost_lower_bound_rad", "bound_met", "deadline_hit"}
"""Fields of a line of results.jsonl that only the planner knows."""
OF_A_PLAN = {"cost_rad", "makespan_s", "min_clearance_m"}

every_planner = pytest.mark.parametrize("name", names())
every_tree = pytest.mark.parametrize("name", [name for name in names() if issubclass(load(name), TreePlanner)])


def planned(name, problem, **more):
    return make(name).plan(problem, **({"seed": 3, "time_limit": 60.0} | more))


@every_planner
@pytest.mark.parametrize("rule", RULES)
def test_the_contract_is_kept(name, rule):
    check_planner(name, rules=[rule])


@every_planner
@pytest.mark.parametrize("problem", two_arms.PROBLEMS)
def test_a_small_problem_is_solved_and_the_checker_agrees(name, problem):
    problem = two_arms.PROBLEMS[problem]()
    result = planned(name, problem)
    assert isinstance(result, PlanResult)
    assert result.status is Status.SOLVED
    report = check_plan(result.plan)
    assert report.valid, report
    assert problem.margin <= result.stats["min_clearance_m"] <= report.found_clearance_m + 1e-6


@every_planner
def test_the_statistics_are_counts_and_describe_the_plan(name):
    problem = two_arms.passing()
    result = planned(name, problem)
    stats, plan = result.stats, result.plan
    assert stats.keys() >= OWNED | OF_A_PLAN
    assert all(stats[key] is None or type(stats[key]) is int for key in COUNTS | {"root_conflicts"})
    assert stats["deadline_hit"] is False
    assert stats["bound_met"] in (True, False, None)
    assert stats["cost_rad"] == pytest.approx(plan.cost_rad, rel=1e-12)
    assert stats["makespan_s"] == plan.makespan_s
    assert stats["cost_lower_bound_rad"] == problem.cost_lower_bound_rad <= plan.cost_rad + 1e-9
    json.dumps(dict(stats), allow_nan=False)


@every_planner
def test_the_plan_names_its_planner_and_contains_no_times_of_the_run(name):
    result = planned(name, two_arms.passing())
    assert (result.plan.planner["name"], result.plan.planner["seed"]) == (name, 3)
    described = {option.name: option.default for option in describe(name).options}
    described.pop("preset", None)  # plans name each option with the value that a preset gave it
    assert result.plan.planner["options"] == described
    assert all(key.endswith("_s") for key in set(result.stats) - set(result.plan.stats))
    assert {key for key in result.plan.stats if key.endswith("_s")} == {"makespan_s"}


@every_tree
def test_a_tree_counts_all_that_it_does(name):
    stats = planned(name, two_arms.passing()).stats
    assert all(type(stats[key]) is int for key in COUNTS | {"root_conflicts"})
    assert stats["root_conflicts"] > 0
    assert type(stats["bound_met"]) is bool


@every_tree
def test_without_conflicts_at_the_root_no_node_is_expanded_and_nothing_is_a_detour(name):
    result = planned(name, two_arms.one_moves())
    assert (result.stats["root_conflicts"], result.stats["expanded_nodes"]) == (0, 0)
    assert result.stats["bound_met"]
    assert result.plan.cost_rad == pytest.approx(0.4)
    assert result.plan.makespan_s == pytest.approx(0.4 / 0.8, abs=0.1)


@every_planner
def test_a_problem_with_all_arms_at_their_goals_has_a_plan_of_rest(name):
    result = planned(name, two_arms.nothing_to_do())
    assert (result.plan.cost_rad, result.plan.makespan_s) == (0.0, 0.0)


@every_planner
@pytest.mark.parametrize("apart", [1e-9, 5e-6])
def test_a_goal_very_close_to_the_start_is_reached(name, apart):
    start = {"left": two_arms.reaching(0.8), "right": two_arms.reaching(0.8)}
    goal = {arm: q + apart for arm, q in start.items()}
    plan = planned(name, make_problem(two_arms.facing_cell(), start, goal)).plan
    assert all((plan.positions[arm][0] == start[arm]).all() for arm in start)
    assert all((plan.positions[arm][-1] == goal[arm]).all() for arm in start)
    assert len(plan.times) == 2


def four_arms():
    """Returns an instance of the ring of four with conflicts of several pairs."""
    cell = ring_cell(4)
    return make_problem(cell, *draw_instance(cell, seed=2))


REPEATED = {"passing": two_arms.passing, "four_arms": four_arms}


def bytes_of(name, problem, folder, **more) -> bytes:
    save_plan(planned(name, problem(), **more).plan, folder / "plan.json")
    return (folder / "plan.json").read_bytes()


@pytest.fixture(scope="module")
def first_time(tmp_path_factory):
    """Returns every planner's plan of every problem, as the text of its file."""
    folder = tmp_path_factory.mktemp("first")
    return {(name, key): bytes_of(name, problem, folder) for name in names() for key, problem in REPEATED.items()}


@every_planner
@pytest.mark.parametrize("key", REPEATED)
def test_watching_changes_no_plan_and_the_same_seed_gives_the_same_file(name, key, first_time, tmp_path):
    events: list[Event] = []
    assert bytes_of(name, REPEATED[key], tmp_path, watch=events.append) == first_time[name, key]
    assert all(isinstance(event, Event) and event.elapsed_s >= 0 for event in events)
    assert any(isinstance(event, SolutionFound) for event in events)


IN_ANOTHER_PROCESS = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from support import two_arms
from mmp_env import make_problem, ring_cell, save_plan
from mmp_env.gym.instances import draw_instance
from mmp_planners import make, names
cell = ring_cell(4)
problems = {"passing": two_arms.passing(), "four_arms": make_problem(cell, *draw_instance(cell, seed=2))}
for name in reversed(names()):
    for key, problem in problems.items():
        save_plan(make(name).plan(problem, seed=3, time_limit=60.0).plan, Path(sys.argv[2]) / f"{name}-{key}.json")
"""


@pytest.fixture(scope="module")
def another_process(tmp_path_factory):
    """Returns plans of a process with another hash seed and the portable variant of the core."""
    folder = tmp_path_factory.mktemp("plans")
    changes = {"PYTHONHASHSEED": "1", "MMP_CORE": core.usable_variants()[0]}
    command = [sys.executable, "-c", IN_ANOTHER_PROCESS, str(TESTS), str(folder)]
    subprocess.run(command, check=True, timeout=300, env=os.environ | changes)
    return folder


@every_planner
@pytest.mark.parametrize("key", REPEATED)
def test_another_process_makes_the_same_file_on_any_processor(name, key, first_time, another_process):
    assert (another_process / f"{name}-{key}.json").read_bytes() == first_time[name, key]


@every_planner
@pytest.mark.parametrize("until", [Event, SolutionFound])
def test_a_watcher_that_stops_the_run_gets_the_best_so_far(name, until):
    events = []

    def watch(event):
        events.append(event)
        if isinstance(event, until):
            raise StopPlanning

    result = planned(name, two_arms.passing(), watch=watch)
    assert [isinstance(event, until) for event in events].index(True) == len(events) - 1, "no event follows"
    has_plan = isinstance(events[-1], SolutionFound)
    assert (result.plan is not None) == has_plan
    assert result.status is (Status.SOLVED if has_plan else Status.TIMEOUT)
    assert result.plan is None or check_plan(result.plan).valid
    assert result.stats.keys() >= OWNED
    json.dumps(dict(result.stats), allow_nan=False)


@every_planner
def test_a_fault_of_the_watcher_is_not_hidden(name):
    def watch(event):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        planned(name, two_arms.passing(), watch=watch)


@every_planner
@pytest.mark.parametrize("limit", [0, 0.0, 1e-7])
def test_without_time_there_is_a_timeout_and_no_exception(name, limit):
    result = planned(name, two_arms.passing(), time_limit=limit)
    assert (result.status, result.plan) == (Status.TIMEOUT, None)
    assert result.stats["deadline_hit"]
    assert result.stats.keys() >= OWNED
    json.dumps(dict(result.stats), allow_nan=False)


@every_planner
@pytest.mark.parametrize("misuse", [{"time_limit": math.nan}, {"seed": -1}])
def test_a_malformed_seed_or_limit_is_misuse(name, misuse):
    with pytest.raises(MmpError, match=next(iter(misuse))):
        planned(name, two_arms.one_moves(), **misuse)


@every_planner
def test_a_planner_has_the_common_signature_and_describes_itself(name):
    assert isinstance(make(name), Planner)
    description = describe(name)
    assert description.name == name
    assert description.summary.endswith(".") or ":" in description.summary
    assert all(option.doc for option in description.options), "each option says what it means"


@every_planner
def test_an_unknown_option_is_answered_with_those_that_exist(name):
    known = sorted(option.name for option in describe(name).options)
    with pytest.raises(MmpError, match=f"planner '{name}' has no option 'colour'.*Known: {', '.join(known)}"):
        make(name, colour="red")


@every_planner
def test_every_option_takes_its_own_default_and_nothing_of_another_type(name):
    options = describe(name).options
    make(name, **{option.name: option.default for option in options})
    for option in options:
        with pytest.raises(MmpError, match=option.name):
            make(name, **{option.name: [option.default]})
