"""The text of values at a prompt, in a notebook and with `print`: a line or two, with units."""

import dataclasses
import functools

import numpy as np
import pytest
from support import straight_plans, tiny_plans

import mmp_env
import mmp_planners
from mmp_env.check.episode import check_episode
from mmp_env.events import NodeCreated, Repelled
from mmp_env.export import export_plan, load_joint_trajectory
from mmp_env.files.episode_file import Episode, episode_to_dict
from mmp_env.files.instance_file import instances_from_dict
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.model.conflict import Conflict
from mmp_env.sim.contacts import Contact
from mmp_env.sim.episode_execution import execute_episode
from mmp_env.view.search_tree import SearchTree
from mmp_planners import PlanResult, Status

LONGEST = 330


@functools.cache
def plan():
    return dataclasses.replace(plan_from_dict(tiny_plans.two_apart()), planner={"name": "by-hand"})


@functools.cache
def execution():
    return execute_episode(Episode(name="one", plans=(plan(),)))


def instances():
    problem = tiny_plans.two_apart()["problem"]
    ends = {"start": problem["start"], "goal": problem["goal"]}
    rows = [{"name": f"test{k}", **ends} for k in range(7)]
    return instances_from_dict({"schema": "mmp-instances/1", "cell": problem["cell"], "instances": rows}, "file")


def grown_tree():
    tree = SearchTree(title="a search")
    tree(created())
    return tree


def created():
    return NodeCreated(
        elapsed_s=0.5,
        node=0,
        parent=None,
        arm=None,
        constraint=None,
        paths=plan().positions,
        cost_rad=1.0,
        lower_bound_rad=1.0,
        conflicts=1,
        conflicting_pairs=1,
    )


def conflict(depth_m):
    q = np.zeros(6)
    return Conflict(
        arm_a="left", arm_b="right", time_s=2, start_s=2, end_s=2.5, q_a=q, q_b=q, spheres=(1, 2), depth_m=depth_m
    )


def arm(name):
    return mmp_env.place_arm("a", name, [-0.55, 0, 0.1], [1, 0, 0, 0])


def obstacle(**measures):
    return mmp_env.Obstacle(name="thing", position=np.zeros(3), quaternion=np.array([1.0, 0, 0, 0]), **measures)


def trajectory(tmp_path):
    export_plan(plan(), tmp_path / "plan.yaml")
    return load_joint_trajectory(tmp_path / "plan.yaml")


VALUES = {
    "a robot": (lambda: mmp_env.load_robot("ur5e"), ["Robot ur5e", "Universal Robots", "6 joints", "m>"]),
    "a tool": (lambda: mmp_env.load_tool("franka-hand"), ["Tool franka-hand", "[0, 0, 0.1034] m"]),
    "spheres": (lambda: mmp_env.load_robot("ur5e").spheres["28"], ["Spheres", "on 7 links"]),
    "an arm": (lambda: arm("panda"), ["Arm a: panda with franka-hand at [-0.55, 0, 0.1] m", "[1, 0, 0, 0]"]),
    "a box": (lambda: obstacle(shape="box", size=np.array([2.0, 1, 0.1])), ["thing: box, 2 x 1 x 0.1 m"]),
    "a rod": (lambda: obstacle(shape="capsule", radius=0.1, length=0.4), ["capsule, radius 0.1 m, length 0.4 m"]),
    "a ring": (lambda: mmp_env.ring_cell(8), ["Cell ring-8: 8 arms (8 ur5e), 1 obstacle (table)", "sphere set 28"]),
    "a cell": (lambda: mmp_env.find_cell("mixed-4"), ["4 arms (2 fr5, 2 piper)"]),
    "collision queries": (lambda: mmp_env.ring_cell(2).collision, ["of cell ring-2: 2 arms", "spheres of set 28"]),
    "a problem": (lambda: plan().problem, ["Problem tiny: 2 arms in cell tiny", "rad along", "margin 1 mm"]),
    "a plan": (plan, ["Plan for tiny: 2 arms, 3 samples", " s, ", " rad, not retimed, by by-hand"]),
    "a result": (lambda: PlanResult(status=Status.SOLVED, plan=plan()), ["PlanResult solved: <Plan for tiny"]),
    "a timeout": (lambda: PlanResult(status=Status.TIMEOUT), ["PlanResult timeout: no plan"]),
    "an error": (lambda: PlanResult(status=Status.ERROR, stats={"message": "out of luck"}), ["error (out of luck)"]),
    "an execution": (
        lambda: execution().reports[0],
        ["every goal reached, no contact", "% of its rating", " s>"],
    ),
    "an executed episode": (execution, ["of 1 plan: every goal reached, 0 contacts", " s>"]),
    "an episode": (lambda: Episode(name="one", plans=(plan(),)), ["Episode one: 1 plan", " s>"]),
    "a conflict": (lambda: conflict(0.0031), ["of left and right from 2.00 to 2.50 s, 3.1 mm deep"]),
    "a near miss": (lambda: conflict(-0.001), ["1.0 mm apart"]),
    "a contact": (lambda: Contact(1.2344, "a/wrist1", "obstacle/table", 0.0021), ["from 1.234 s on, 2.10 mm deep"]),
    "an instance file": (
        instances,
        ["7 instances (test0, test1,", ", ...) of 2 arms in cell tiny"],
    ),
    "an instance": (lambda: instances().instances[0], ["Instance test0 of 2 arms"]),
    "a check": (lambda: mmp_env.check_plan(plan()), ["CheckReport valid; clearance >= ", "mm"]),
    "a refutation": (lambda: mmp_env.check_plan({"schema": "mmp-plan/1"}), ["CheckReport invalid; ", "schema: "]),
    "a checked episode": (lambda: check_episode(episode_to_dict(Episode(name="one", plans=(plan(),)))), ["1 plan"]),
    "a tree": (grown_tree, ["SearchTree of a search: 1 node, 0 expanded, no solution"]),
    "a node": (lambda: grown_tree().nodes[0], ["TreeNode 0: a root, 1 conflict, 1.00 rad"]),
    "an event": (created, ["elapsed_s=0.5", "paths=2 paths", "cost_rad=1.0"]),
    "a repulsion": (
        lambda: Repelled(elapsed_s=0.5, arm="left", before=np.zeros((70, 6)), after=np.zeros((70, 6)), iterations=3),
        ["arm='left'", "before=70x6"],
    ),
}


@pytest.mark.parametrize("kind", VALUES)
def test_a_value_describes_itself_in_a_line(kind):
    make, words = VALUES[kind]
    text = repr(make())
    assert len(text) <= LONGEST
    assert text.isprintable()
    assert "array(" not in text
    for word in words:
        assert word in text


def test_a_trajectory_that_was_read_back_is_a_line_too(tmp_path):
    assert "of 12 joints: 3 samples, " in repr(trajectory(tmp_path))


def test_print_says_the_same_unless_a_report_has_more_lines():
    for value in (plan(), plan().problem, plan().problem.cell, PlanResult(status=Status.SOLVED, plan=plan())):
        assert str(value) == repr(value)


def test_every_planner_and_its_results_are_short():
    problem = mmp_env.draw_problem(mmp_env.ring_cell(2), seed=1)
    for name in mmp_planners.names():
        planner = mmp_planners.make(name)
        assert len(repr(planner)) <= 2 * LONGEST
    assert len(repr(planner.plan(problem, seed=1, time_limit=10.0))) <= LONGEST


def test_an_environment_and_a_drawn_instance_describe_themselves():
    env = mmp_env.MultiArmCellEnv(cell="ring-2")
    env.reset(seed=3)
    assert repr(env.problem).startswith("<Problem ring-2/3: 2 arms in cell ring-2, ")


def test_retimed_plans_say_so():
    from mmp_env.retime import retime

    cell = mmp_env.ring_cell(2)
    start, goal = straight_plans.everyone(cell, "tucked"), straight_plans.elsewhere(cell)
    assert " rad, retimed" in repr(retime(straight_plans.straight(cell, start, goal)))


def test_malformed_values_and_wild_names_are_shown_as_well():
    broken = dataclasses.replace(plan())
    object.__setattr__(broken, "positions", None)
    assert repr(broken).startswith("<mmp_env.model.plan.Plan object at ")
    wild = dataclasses.replace(plan(), planner={"name": "a\n\x1b[31mb" + "c" * 1000})
    text = repr(wild)
    assert "a\\n\\x1b[31mbc" in text
    assert text.isprintable()
    assert len(text) <= LONGEST


def test_no_value_that_holds_arrays_prints_them():
    """Every public value with arrays, mappings or other values as fields defines its own text."""
    public = [getattr(mmp_env, name) for name in mmp_env.__all__]
    for value in [*public, PlanResult]:
        if isinstance(value, type) and dataclasses.is_dataclass(value):
            kinds = [str(field.type) for field in dataclasses.fields(value)]
            bulky = any(word in kind for kind in kinds for word in ("ndarray", "Mapping", "Cell", "Plan", "dict"))
            assert not bulky or value.__repr__.__wrapped__, value
