"""RRT-Connect for growing groups of arms: its paths, standing arms in the way, and edges side by side."""

from itertools import pairwise

import numpy as np
import pytest
from reference import clearance
from support import two_arms

from mmp_env import core, draw_problem, find_cell, line_cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.problems.making import make_problem

FLOAT_M = 1e-5


def joints(problem, q):
    return np.concatenate([q[name] for name in problem.cell.arm_names])


def search_of(problem, seed=0, **given):
    return core.GroupSearch(
        problem.cell.collision.core,
        start=joints(problem, problem.start),
        goal=joints(problem, problem.goal),
        samples=problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
        edges=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
        seed=seed,
        **given,
    )


def forever():
    return core.Clock(np.inf)


def crowded():
    return draw_problem(find_cell("ring-6"), seed=3)


def many():
    return draw_problem(line_cell(16), seed=1)


def exchanged():
    """Returns a problem in which each hand stands at the goal of the other."""
    cell = two_arms.facing_cell(1.2)
    ends = [{"left": two_arms.reaching(pan), "right": two_arms.reaching(pan)} for pan in (0.3, -0.3)]
    return make_problem(cell, *ends)


def moving_arms(problem, path):
    """Returns the arms that move on each edge."""
    rows = [np.split(q, np.cumsum([arm.dof for arm in problem.cell.arms])[:-1]) for q in path]
    return [{k for k, (a, b) in enumerate(zip(p, q, strict=True)) if (a != b).any()} for p, q in pairwise(rows)]


@pytest.mark.parametrize("kind", [two_arms.passing, two_arms.parked_arm_between, crowded, many])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_path_goes_from_start_to_goal_and_is_proved_in_double_precision(kind, seed):
    problem = kind()
    path = search_of(problem, seed).grow(1_000_000, forever())
    np.testing.assert_array_equal(path[0], joints(problem, problem.start).astype(np.float32))
    np.testing.assert_array_equal(path[-1], joints(problem, problem.goal).astype(np.float32))
    rows = [np.ascontiguousarray(q) for q in np.split(path, len(problem.cell.arms), axis=1)]
    required = problem.levels(KEEP_MARGIN_FACTOR / 2, KEEP_MARGIN_FACTOR / 2)
    proof = core.certify(problem.cell.collision.core, rows, required, 0.5, forever())
    assert proof.valid, (proof.arm_a, proof.arm_b, proof.segment)
    assert all(moving_arms(problem, path))


@pytest.mark.parametrize("kind", [two_arms.passing, two_arms.parked_arm_between])
def test_a_path_is_clear_by_the_reference(kind):
    problem = kind()
    path = search_of(problem).grow(1_000_000, forever())
    least = problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof
    for a, b in pairwise(path):
        for q in a + np.linspace(0, 1, 40)[:, None] * (b - a):
            gap = clearance.moving_clearance(problem.cell, "left", q[:6], "right", q[6:])
            assert (
                min(
                    gap,
                    *(clearance.static_clearance(problem.cell, n, p) for n, p in (("left", q[:6]), ("right", q[6:]))),
                )
                >= least - FLOAT_M
            )


def test_arms_that_stand_at_the_goals_of_each_other_are_planned_together():
    problem = exchanged()
    assert search_of(problem, most=1).grow(3000, forever()) is None
    path = search_of(problem, most=2).grow(1_000_000, forever())
    assert set().union(*moving_arms(problem, path)) == {0, 1}


def test_arms_that_are_far_apart_move_side_by_side():
    problem = many()
    moving = moving_arms(problem, search_of(problem).grow(1_000_000, forever()))
    arms = len(problem.cell.arms)
    alone = sum(map(len, moving))  # number of edges if the arms moved one by one
    assert len(moving) < 0.7 * alone
    assert any(min(some) < arms / 4 and max(some) >= 3 * arms / 4 for some in moving)


def test_a_search_in_slices_finds_the_same_path_as_one_call():
    problem = crowded()
    path = search_of(problem).grow(1_000_000, forever())
    sliced, found = search_of(problem), None
    while found is None:
        found = sliced.grow(7, forever())
    np.testing.assert_array_equal(found, path)


def test_another_seed_finds_another_path():
    paths = [search_of(crowded(), seed).grow(1_000_000, forever()) for seed in (0, 1)]
    assert paths[0].shape != paths[1].shape or (paths[0] != paths[1]).any()


def test_arms_that_are_at_their_goals_need_not_move():
    path = search_of(two_arms.nothing_to_do()).grow(1, forever())
    assert path.shape == (1, 12)


def test_no_iterations_and_no_time_find_nothing():
    assert search_of(crowded()).grow(0, forever()) is None
    clock = forever()
    clock.cancel()
    search = search_of(crowded())
    assert search.grow(1_000_000, clock) is None
    assert search.iterations < 100


def test_wrong_states_and_groups_are_refused():
    problem = two_arms.passing()
    levels = {"samples": core.Levels(1e-3, 1e-3), "edges": core.Levels(1e-3, 1e-3), "seed": 0}
    cell = problem.cell.collision.core
    with pytest.raises(ValueError, match="number of joints"):
        core.GroupSearch(cell, start=np.zeros(12), goal=np.zeros(5), **levels)
    with pytest.raises(ValueError, match="finite"):
        core.GroupSearch(cell, start=np.full(12, np.nan), goal=np.zeros(12), **levels)
    with pytest.raises(ValueError, match="one arm at least"):
        core.GroupSearch(cell, start=np.zeros(12), goal=np.zeros(12), most=0, **levels)
