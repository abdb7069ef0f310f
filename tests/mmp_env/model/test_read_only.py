"""Problems, plans and cells are read-only, and so are copies of them."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from support import stand_in_planners, two_arms

from mmp_env.files.plan_file import plan_to_dict

PLAN = replace(
    stand_in_planners.straight_plan(two_arms.passing(1.0), {"name": "straight", "options": {"w": 1.0}}),
    stats={"tries": 3},
)
HANDED_ON = {
    "as it is": lambda value: value,
    "copied": copy.copy,
    "deep-copied": copy.deepcopy,
    "pickled": lambda value: pickle.loads(pickle.dumps(value)),
    "replaced": replace,
}


@pytest.fixture(params=HANDED_ON)
def plan(request):
    """Returns the plan itself, or one kind of copy of it."""
    return HANDED_ON[request.param](PLAN)


def mappings(plan):
    problem, arm = plan.problem, plan.problem.cell.arms[0]
    yield from (problem.start, problem.goal, problem.max_velocity, plan.positions, plan.planner, plan.stats)
    yield from (plan.planner["options"], arm.robot.spheres, arm.robot.self_ignore)


def arrays(plan):
    problem, arm = plan.problem, plan.problem.cell.arms[0]
    yield from (*problem.start.values(), *problem.goal.values(), *problem.max_velocity.values())
    yield from (problem.joint_start, problem.joint_goal, problem.joint_max_velocity)
    yield from (plan.times, *plan.positions.values(), arm.position, arm.quaternion, arm.robot.lower)
    yield from (spheres.radii for spheres in arm.robot.spheres.values())


def test_no_mapping_takes_another_value(plan):
    for mapping in mappings(plan):
        before, key = dict(mapping), next(iter(mapping))
        for change in (
            lambda mapping, key: mapping.__setitem__(key, 0),
            lambda mapping, key: mapping.__delitem__(key),
            lambda mapping, key: mapping.__ior__({key: 0}),
            lambda mapping, key: mapping.update({key: 0}),
            lambda mapping, key: mapping.setdefault("other", 0),
            lambda mapping, key: mapping.pop(key),
            lambda mapping, key: mapping.popitem(),
            lambda mapping, key: mapping.clear(),
        ):
            with pytest.raises(TypeError, match="read-only"):
                change(mapping, key)
        assert list(mapping) == list(before)
        assert all(mapping[name] is before[name] for name in before)


def test_no_array_takes_another_number(plan):
    for array in arrays(plan):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_a_copy_equals_the_plan(plan):
    assert plan_to_dict(plan) == plan_to_dict(PLAN)


def test_a_dict_made_from_a_mapping_can_be_changed():
    start = PLAN.problem.start
    for mine in (dict(start), start.copy(), start | {}):
        mine["other"] = np.zeros(1)
    assert "other" not in start


def test_a_problem_with_another_start_and_goal_has_other_joints():
    problem = PLAN.problem
    before = problem.joint_start, problem.joint_goal
    swapped = replace(problem, start=problem.goal, goal=problem.start)
    assert np.array_equal(swapped.joint_start, before[1])
    assert np.array_equal(swapped.joint_goal, before[0])
    assert not np.array_equal(*before)
