"""Shortcutting on the common clock makes safe plans shorter and keeps them safe."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from reference import clearance, motion, toys
from support import two_arms

import mmp_planners
from mmp_env import core, draw_instance, ring_cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.problems.making import make_problem
from mmp_planners.portfolio.shortcutting import on_grid

DT_S = 0.1


def shortened(problem, rows, attempts=400, min_saving=math.inf, seed=0, clock=None, groups=(0, 0), goals=None):
    names = problem.cell.arm_names
    speeds = [problem.max_velocity[name] * DT_S for name in names]
    clock = clock or core.Clock(math.inf)
    return core.shortcut(
        problem.cell.collision.core,
        rows,
        speeds,
        goals=goals or [q[:0] for q in rows],
        levels=problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
        groups=groups,
        settings=core.ShortcutSettings(attempts=attempts, min_saving=min_saving),
        seed=seed,
        clock=clock,
    )


def detour(q_from, q_via, q_to, steps):
    """Returns a path through a via point, with `steps` for each half."""
    there = q_from + np.linspace(0, 1, steps + 1)[:, None] * (q_via - q_from)
    back = q_via + np.linspace(0, 1, steps + 1)[1:, None] * (q_to - q_via)
    return np.vstack([there, back])


def length(rows):
    return sum(np.abs(np.diff(q, axis=0)).sum() for q in rows)


def aside():
    """Returns a plan in which the left arm makes a needless detour. The right arm stands still."""
    problem = two_arms.one_moves()
    start, goal = problem.start["left"], problem.goal["left"]
    via = (start + goal) / 2 + [0.3, 0.2, -0.3, 0.0, 0.2, 0.0]
    return problem, [detour(start, via, goal, 8), np.repeat(problem.start["right"][None], 17, axis=0)]


def over():
    """Returns a plan in which the left arm lifts its hand over the right arm, which blocks the straight line."""
    problem = two_arms.parked_arm_between()
    start, goal = problem.start["left"], problem.goal["left"]
    via = two_arms.reaching(0.0) + np.array([0.0, -0.9, -0.6, 0.0, 0.0, 0.0])
    return problem, [detour(start, via, goal, 40), np.repeat(problem.start["right"][None], 81, axis=0)]


def test_a_detour_in_the_open_becomes_straight():
    problem, rows = aside()
    found, kept = shortened(problem, rows)
    assert kept > 0
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=2e-3)
    assert len(found[0]) == len(found[1])


def lifted():
    """Returns a plan like `over` with a higher goal, so lifting before turning is no detour."""
    raised = np.array([0.0, -0.4, -0.2, 0.0, 0.0, 0.0])
    start = {"left": two_arms.reaching(0.8), "right": two_arms.reaching(0.0)}
    goal = {"left": two_arms.reaching(-0.8) + raised, "right": two_arms.reaching(0.0)}
    problem = make_problem(two_arms.facing_cell(0.95), start, goal)
    high = detour(start["left"], two_arms.reaching(0.0) + 1.3 * raised, goal["left"], 40)
    return problem, [high, np.repeat(start["right"][None], 81, axis=0)]


@pytest.mark.parametrize("seed", range(4))
def test_a_path_on_which_no_joint_turns_back_is_as_short_as_the_straight_line(seed):
    problem, rows = lifted()
    straight = detour(
        problem.start["left"], (problem.start["left"] + problem.goal["left"]) / 2, problem.goal["left"], 40
    )
    assert problem.cell.collision.pair_clearance("left", straight, "right", rows[1]).min() < 0
    found, _ = shortened(problem, rows, attempts=800, seed=seed)
    assert length(rows) > 1.1 * problem.cost_lower_bound_rad
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=2e-3)


def test_a_detour_around_an_arm_gets_shorter_and_stays_clear_by_the_reference():
    problem, rows = over()
    found, kept = shortened(problem, rows)
    assert kept > 0
    assert length(found) < length(rows)
    gap = clearance.clearance_of_motions(problem.cell, "left", found[0], "right", found[1])
    assert gap >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5


def test_ends_and_velocity_limits_are_kept():
    for problem, rows in (aside(), over(), lifted()):
        found, _ = shortened(problem, rows)
        for name, before, after in zip(problem.cell.arm_names, rows, found, strict=True):
            np.testing.assert_array_equal(after[[0, -1]], before[[0, -1]].astype(np.float32))
            assert (np.abs(np.diff(after, axis=0)) <= problem.max_velocity[name] * DT_S * (1 + 1e-4)).all()


def test_the_same_seed_gives_the_same_shortcuts():
    problem, rows = over()
    (first, kept), (second, again) = shortened(problem, rows, seed=5), shortened(problem, rows, seed=5)
    assert kept == again
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_without_attempts_or_time_a_plan_stays_as_it_is():
    problem, rows = over()
    cancelled = core.Clock(math.inf)
    cancelled.cancel()
    for found, kept in (shortened(problem, rows, attempts=0), shortened(problem, rows, clock=cancelled)):
        assert kept <= 7
        assert length(found) <= length(rows) + 1e-4
    assert shortened(problem, rows, attempts=0)[1] == 0


def test_a_straight_plan_is_not_changed():
    problem = two_arms.passing()
    rows = [np.linspace(problem.start[n], problem.goal[n], 21) for n in problem.cell.arm_names]
    found, kept = shortened(problem, rows)
    assert kept == 0
    np.testing.assert_allclose(found[0], rows[0], atol=1e-6)


def test_an_arm_goes_straight_through_one_of_another_group():
    problem, rows = over()
    found, kept = shortened(problem, rows, groups=(0, 1))
    assert kept > 0
    assert length(found) < length(shortened(problem, rows)[0]) - 0.1
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=2e-3)
    assert clearance.clearance_of_motions(problem.cell, "left", found[0], "right", found[1]) < 0


def test_an_arm_ends_at_another_of_its_goals_where_that_is_shorter():
    problem, rows = over()
    end, stay = rows[0][-1], rows[1][:1]
    before_the_other_arm = rows[0][0] + 0.2 * (end - rows[0][0])
    behind_it = end + 0.3 * np.eye(6)[0]
    found, kept = shortened(problem, rows, goals=[np.array([end, behind_it, before_the_other_arm]), stay])
    assert kept > 0
    np.testing.assert_array_equal(found[0][-1], before_the_other_arm.astype(np.float32))
    assert length(found) == pytest.approx(np.abs(before_the_other_arm - rows[0][0]).sum(), abs=2e-3)


def test_an_arm_keeps_its_goal_where_the_nearer_one_is_blocked():
    problem, rows = over()
    blocked = two_arms.reaching(0.0)[None]  # where the other arm stands
    ends = [np.vstack([rows[0][-1:], blocked]), rows[1][:1]]
    found, _ = shortened(problem, rows, goals=ends)
    np.testing.assert_array_equal(found[0][-1], rows[0][-1].astype(np.float32))


def test_arms_of_one_group_keep_clear_of_each_other_and_of_no_other():
    cell = ring_cell(4, "panda")
    problem = make_problem(cell, *draw_instance(cell, seed=7))
    rows = on_grid(mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0).plan, DT_S)
    names = cell.arm_names

    def gap(found, a, b):
        return clearance.clearance_of_motions(cell, names[a], found[a], names[b], found[b])

    lengths = {}
    for groups in ((0, 0, 0, 0), (5, 5, -1, -1), (-1, 5, 5, -1), (5, 7, 5, -1), (0, 1, 2, 3)):
        found, kept = shortened(problem, rows, groups=groups, attempts=1000)
        assert kept > 0
        lengths[groups] = length(found)
        for a, b in itertools.combinations(range(4), 2):
            if groups[a] == groups[b]:
                assert gap(found, a, b) >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5
    assert max(lengths, key=lengths.get) == (0, 0, 0, 0)
    assert lengths[0, 1, 2, 3] == pytest.approx(min(lengths.values()), abs=1e-2)
    assert lengths[0, 0, 0, 0] > lengths[0, 1, 2, 3] + 1


def about_a_post():
    """Returns a plan in which the left arm lifts its hand over a post. The right arm is out of reach."""
    post = toys.solid("cylinder", [0.03, 0.0, 0.1], name="post", radius=0.04, length=0.5)
    cell = dataclasses.replace(two_arms.facing_cell(), obstacles=(post,))
    start = {"left": two_arms.reaching(0.8), "right": two_arms.reaching(1.5)}
    goal = {"left": two_arms.reaching(-0.8), "right": two_arms.reaching(1.5)}
    via = two_arms.reaching(0.0) + np.array([0.0, -0.9, -0.6, 0.0, 0.0, 0.0])
    rows = [detour(start["left"], via, goal["left"], 40), np.repeat(start["right"][None], 81, axis=0)]
    return make_problem(cell, start, goal), rows


def test_an_arm_in_a_group_of_its_own_keeps_clear_of_obstacles():
    problem, rows = about_a_post()
    assert motion.edge_clearance(problem.cell, "left", problem.start["left"], problem.goal["left"]) < 0
    (left, _), kept = shortened(problem, rows, groups=(0, 1))
    assert kept > 0
    assert length([left]) < length(rows) - 0.1
    steps = itertools.pairwise(left)
    gap = min(motion.edge_clearance(problem.cell, "left", a, b, samples=4) for a, b in steps)
    assert gap >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5


def test_rounds_repeat_while_they_save_enough():
    problem, rows = over()
    once, kept = shortened(problem, rows, attempts=20)
    again, kept_in_all = shortened(problem, rows, attempts=20, min_saving=1e-3)
    assert kept_in_all > kept
    assert length(again) < (1 - 1e-3) * length(once)
    assert clearance.clearance_of_motions(problem.cell, "left", again[0], "right", again[1]) > 0


def test_a_round_that_saves_too_little_is_the_last():
    problem, rows = over()
    once, kept = shortened(problem, rows, attempts=20)
    again, kept_in_all = shortened(problem, rows, attempts=20, min_saving=1.0)
    assert kept == kept_in_all
    for a, b in zip(once, again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_shortcutting_ends_when_nothing_can_be_saved():
    problem = two_arms.nothing_to_do()
    still = [np.repeat(problem.start[n][None], 5, axis=0) for n in problem.cell.arm_names]
    for min_saving in (math.inf, 1e-3, 1e-300):
        clock = core.Clock(60.0)
        assert shortened(problem, still, min_saving=min_saving, clock=clock)[1] == 0
        assert not clock.expired


def test_a_saving_that_is_not_positive_is_refused():
    problem, rows = aside()
    for min_saving in (0.0, -0.1, math.nan):
        with pytest.raises(ValueError, match="min_saving must be positive"):
            shortened(problem, rows, min_saving=min_saving)


def test_rows_that_do_not_match_are_refused():
    problem, rows = aside()
    with pytest.raises(ValueError, match="the same number of rows"):
        shortened(problem, [rows[0], rows[1][:-1]])
    with pytest.raises(ValueError, match="one array per arm"):
        shortened(problem, rows[:1])
    for groups in ((), (0,), (0, 0, 0)):
        with pytest.raises(ValueError, match="one group per arm"):
            shortened(problem, rows, groups=groups)


def test_steps_of_no_length_are_refused():
    problem, rows = aside()
    for slow in (0.0, -0.1, np.nan):
        speeds = [np.full(6, 0.08), np.append(np.full(5, 0.08), slow)]
        with pytest.raises(ValueError, match="steps must be from 1e-5 to 1e4 rad"):
            core.shortcut(
                problem.cell.collision.core,
                rows,
                speeds,
                goals=[q[:0] for q in rows],
                levels=core.Levels(1e-3, 1e-3),
                groups=(0, 0),
                settings=core.ShortcutSettings(attempts=10),
                seed=0,
                clock=core.Clock(math.inf),
            )
