"""RRT-Connect over all arms: its paths, and continued searches."""

from itertools import pairwise

import numpy as np
import pytest
from reference import clearance
from support import two_arms

from mmp_env import core
from mmp_env.gym.instances import draw_instance
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.problems.making import make_problem

RANGE_RAD, STEP_RAD = 2.0, 0.05
FLOAT_M = 1e-5
LEVELS = core.Levels(1e-3, 1e-3)


def search_of(problem, seed=0, edge=RANGE_RAD, step=STEP_RAD):
    names = problem.cell.arm_names
    start, goal = (np.concatenate([q[name] for name in names]) for q in (problem.start, problem.goal))
    return composite_search(
        problem,
        start,
        goal,
        samples=problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
        edges=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
        seed=seed,
        settings=core.CompositeSettings(range=edge, step=step),
    )


def composite_search(problem, start, goal, **given):
    defaults = {"samples": LEVELS, "edges": LEVELS, "seed": 0}
    return core.CompositeSearch(
        problem.cell.collision.core, start=start, goals=np.atleast_2d(goal), **(defaults | given)
    )


def forever():
    return core.Clock(np.inf)


def crowded(seed=3):
    cell = ring_cell(6)
    return make_problem(cell, *draw_instance(cell, seed=seed))


def test_a_search_of_some_arms_keeps_these_clear_of_each_other():
    """The straight lines of the two arms meet."""
    problem, members = crowded(), [1, 2]
    names = [problem.cell.arm_names[k] for k in members]
    start, goal = (np.concatenate([q[n] for n in names]) for q in (problem.start, problem.goal))
    path = composite_search(problem, start, goal, arms=members).grow(1_000_000, forever())
    np.testing.assert_allclose(path[[0, -1]], [start, goal], atol=FLOAT_M)
    share = np.linspace(0, 1, 20)[:, None]
    rows = np.concatenate([p + share * (q - p) for p, q in pairwise(path)])
    clear = problem.cell.collision.pair_clearance(names[0], rows[:, :6], names[1], rows[:, 6:])
    assert clear.min() > LEVELS.margin - FLOAT_M


@pytest.mark.parametrize("kind", [two_arms.passing, two_arms.parked_arm_between, crowded])
def test_a_path_goes_from_start_to_goal_by_edges_on_which_no_arm_moves_farther_than_the_range(kind):
    problem = kind()
    path = search_of(problem).grow(1_000_000, forever())
    names = problem.cell.arm_names
    np.testing.assert_array_equal(path[0], np.concatenate([problem.start[n] for n in names]).astype(np.float32))
    np.testing.assert_array_equal(path[-1], np.concatenate([problem.goal[n] for n in names]).astype(np.float32))
    for rows in np.split(path, len(names), axis=1):
        assert np.linalg.norm(np.diff(rows, axis=0), axis=1).max() <= RANGE_RAD * (1 + 1e-5)


def dense(path, samples=60):
    """Returns configurations of all joints along a path, [n, joints]."""
    fractions = np.linspace(0, 1, samples, endpoint=False)[:, None]
    return np.concatenate([*(a + fractions * (b - a) for a, b in pairwise(path)), path[-1:]])


def split(cell, q):
    """Returns arm -> [dof] of a row of all joints."""
    return dict(zip(cell.arm_names, np.split(q, np.cumsum([arm.dof for arm in cell.arms])[:-1]), strict=True))


@pytest.mark.parametrize("step", [STEP_RAD, 2.0])
def test_a_path_is_clear_between_its_samples_by_the_reference(step):
    problem = two_arms.passing()
    path = search_of(problem, step=step).grow(1_000_000, forever())
    for q in dense(path):
        between = clearance.moving_clearance(problem.cell, "left", q[:6], "right", q[6:])
        assert between >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - FLOAT_M


def obstacle_between():
    """Returns a problem with a ball on the straight line of the left hand. The right arm is far away."""
    tip = two_arms.facing_cell(2.4).collision.tool_points("left", two_arms.reaching(0.0)[None])[0]
    ball = {"position": frozen_array(tip), "quaternion": frozen_array([1.0, 0, 0, 0]), "radius": 0.05}
    cell = Cell(
        name="ball", arms=two_arms.facing_cell(2.4).arms, obstacles=(Obstacle(name="o", shape="sphere", **ball),)
    )
    return turned(cell, 0.8, -0.8)


def base_between():
    """Returns a problem with the other arm's base on the straight line of the left forearm."""
    left = place_arm("left", "ur5e", [-0.3, 0, 0], quaternion_from_yaw(0.0))
    right = place_arm("right", "ur5e", [0.3, 0, 0], quaternion_from_yaw(0.0))
    return turned(Cell(name="close", arms=(left, right)), 1.2, -1.2, low=True)


def turned(cell, start, goal, low=False):
    """Returns a problem in which the left arm turns its first joint. The right arm stands still."""
    ends = [{"left": reach(pan, low), "right": two_arms.reaching(0.0)} for pan in (start, goal)]
    return make_problem(cell, *ends)


def reach(pan, low):
    return two_arms.reaching(pan) + (np.array([0, 0.6, 0.3, 0, 0, 0]) if low else 0)


def itself_between():
    """Returns a problem in which the straight line of the left arm is in self-collision: the first drawn."""
    cell = two_arms.facing_cell(2.4)
    rng = np.random.default_rng(5)
    q = rng.uniform(-2.8, 2.8, (4000, 6))
    q = q[cell.collision.is_free("left", q, margin=0.01)]
    middle = [clearance.self_clearance(cell, "left", (a + b) / 2) for a, b in pairwise(q[:80])]
    k = int(np.argmax(np.array(middle) < -0.02))
    assert middle[k] < -0.02
    return make_problem(cell, *({"left": q[n], "right": two_arms.reaching(0.0)} for n in (k, k + 1)))


@pytest.mark.parametrize("step", [STEP_RAD, 2.0])
@pytest.mark.parametrize(
    ("kind", "what"),
    [
        (obstacle_between, clearance.obstacle_clearance),
        (base_between, clearance.base_clearance),
        (itself_between, clearance.self_clearance),
    ],
)
def test_a_path_is_clear_of_obstacles_bases_and_the_arms_themselves_by_the_reference(kind, what, step):
    problem = kind()
    cell = problem.cell
    straight = np.linspace(problem.start["left"], problem.goal["left"], 60)
    assert min(what(cell, "left", q) for q in straight) < 0, "the straight line is blocked"
    path = search_of(problem, step=step).grow(1_000_000, forever())
    for row in dense(path, 40):
        q = split(cell, row)
        least = min(clearance.static_clearance(cell, arm, q[arm]) for arm in q)
        least = min(least, clearance.moving_clearance(cell, "left", q["left"], "right", q["right"]))
        assert least >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - FLOAT_M


def test_hardly_any_state_of_a_path_could_move_between_its_neighbours():
    could, states = [], 0
    for problem in (obstacle_between(), base_between(), itself_between()):
        for seed in range(20):
            q = search_of(problem, seed).grow(1_000_000, forever())[:, :6].astype(float)
            cut = np.clip(q[1:-1], np.minimum(q[:-2], q[2:]), np.maximum(q[:-2], q[2:]))
            for before, old, new, after in zip(q, q[1:], cut, q[2:], strict=False):
                if np.abs(new - old).sum() > 0.06:
                    ends = np.array([before, new]), np.array([new, after])
                    could.append(problem.cell.collision.edge_free("left", *ends, margin=0.006).all())
            states += len(cut)
    assert could.count(False) > 20, "otherwise no state is blocked"
    assert sum(could) < 0.05 * states


def test_arms_that_would_meet_go_one_after_the_other():
    problem = two_arms.passing()
    path = search_of(problem, edge=4.0).grow(1, forever())
    assert len(path) == 3
    moves = [[bool((a[part] != b[part]).any()) for part in (slice(6), slice(6, 12))] for a, b in pairwise(path)]
    assert moves in ([[True, False], [False, True]], [[False, True], [True, False]])
    assert_proved(problem, path)


@pytest.mark.parametrize("seed", range(3))
def test_each_edge_of_a_path_moves_arms_that_are_clear_of_all_others_where_they_stand(seed):
    problem = crowded(seed)
    path = search_of(problem, seed).grow(1_000_000, forever())
    standing = 0
    for a, b in pairwise(np.split(row, len(problem.cell.arms)) for row in path):
        moves = [bool((p != q).any()) for p, q in zip(a, b, strict=True)]
        assert any(moves)
        standing += moves.count(False)
    assert standing > 0, "otherwise all arms move on every edge"
    assert_proved(problem, path)


def test_the_proof_removes_an_edge_that_coarse_samples_let_through_and_the_search_goes_on():
    """With one sample per edge, its end, both hands move at once through each other on the first edge."""
    problem = two_arms.passing()
    coarse = search_of(problem, edge=4.0, step=2.0)
    assert coarse.grow(1, forever()) is None
    assert coarse.nodes == 3, "start, goal, and the goal again at the end of the straight edge"
    path = coarse.grow(1_000_000, forever())
    assert len(path) > 2
    assert_proved(problem, path)


@pytest.mark.parametrize("seed", range(4))
def test_paths_of_coarse_samples_are_proved(seed):
    """The paths are longer, and the proof removes edges of both trees."""
    problem = crowded(seed)
    coarse, fine = (search_of(problem, seed, step=step) for step in (1.0, STEP_RAD))
    assert_proved(problem, coarse.grow(1_000_000, forever()))
    assert_proved(problem, fine.grow(1_000_000, forever()))


def assert_proved(problem, path):
    """Certifies in double precision what the search proved in single precision."""
    rows = [np.ascontiguousarray(q) for q in np.split(path, len(problem.cell.arms), axis=1)]
    required = problem.levels(KEEP_MARGIN_FACTOR / 2, KEEP_MARGIN_FACTOR / 2)
    proof = core.certify(problem.cell.collision.core, rows, required, 0.5, forever())
    assert proof.valid, (proof.arm_a, proof.arm_b, proof.segment)
    assert proof.clearance > 0


def test_a_search_in_slices_finds_the_same_path_as_one_call():
    problem = crowded()
    once, sliced = search_of(problem), search_of(problem)
    path = once.grow(1_000_000, forever())
    found = None
    while found is None:
        found = sliced.grow(7, forever())
    np.testing.assert_array_equal(found, path)
    assert sliced.iterations == once.iterations
    assert sliced.nodes == once.nodes


def test_another_seed_finds_another_path():
    problem = crowded()
    paths = [search_of(problem, seed).grow(1_000_000, forever()) for seed in (0, 1)]
    assert paths[0].shape != paths[1].shape or (paths[0] != paths[1]).any()


def test_arms_that_are_at_their_goals_need_not_move():
    problem = two_arms.nothing_to_do()
    path = search_of(problem).grow(1, forever())
    assert path.shape == (2, 12)
    np.testing.assert_array_equal(path[0], path[1])


def test_no_iterations_and_no_time_find_nothing():
    assert search_of(crowded()).grow(0, forever()) is None
    clock = forever()
    clock.cancel()
    search = search_of(crowded())
    assert search.grow(1_000_000, clock) is None
    assert search.iterations < 100


def test_states_of_the_wrong_size_are_refused():
    problem = two_arms.passing()
    q = np.zeros(5)
    with pytest.raises(ValueError, match="number of joints"):
        composite_search(problem, q, q)


@pytest.mark.parametrize(("edge", "step"), [(0.0, STEP_RAD), (RANGE_RAD, 0.0), (-1.0, STEP_RAD), (np.nan, STEP_RAD)])
def test_edges_and_steps_of_no_length_are_refused(edge, step):
    with pytest.raises(ValueError, match="range and step"):
        search_of(two_arms.passing(), edge=edge, step=step)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e9])
def test_a_start_or_goal_that_is_not_finite_is_refused(value):
    problem = two_arms.passing()
    free, broken = np.zeros(12), np.full(12, value)
    for ends in ((free, broken), (broken, free)):
        with pytest.raises(ValueError, match="finite"):
            composite_search(problem, *ends)
