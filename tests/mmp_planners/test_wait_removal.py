"""Wait removal: paths and order stay, arms move as early as their swept volumes let them, and the proof holds."""

import itertools
import math

import numpy as np
import pytest
from support import two_arms
from support.arms_on_a_line import refusal

import mmp_planners
from mmp_env import check_plan, core, draw_problem, find_cell
from mmp_env.model.certificate import certify
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.problems.making import make_problem
from mmp_planners.portfolio import run as run_module
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits
from mmp_planners.portfolio.wait_removal import without_waits

FOREVER = core.Clock(math.inf)
STEP_RAD = 0.2  # as in native/improve/wait_removal.hpp


def one_after_the_other(problem, order):
    """Returns a plan in which the arms go straight to their goals, one after the other."""
    q = dict(problem.start)
    rows = {name: [q[name]] for name in problem.cell.arm_names}
    for moving in order:
        q[moving] = problem.goal[moving]
        for name, configurations in rows.items():
            configurations.append(q[name])
    return retime_to_velocity_limits(problem, [np.array(rows[name]) for name in problem.cell.arm_names])


def along(path, shares):
    """Returns the configurations at shares of the length of a path."""
    length = np.concatenate([[0.0], np.abs(np.diff(path, axis=0)).sum(axis=1).cumsum()])
    return np.stack([np.interp(shares * length[-1], length, joint) for joint in path.T])


def begin_of_motion(plan, name):
    """Returns the time [s] at which an arm begins to move."""
    moved = np.abs(plan.positions[name] - plan.positions[name][0]).max(axis=1) > 1e-9
    return plan.times[np.argmax(moved) - 1]


def test_arms_that_stay_apart_move_at_the_same_time():
    problem = two_arms.turning((1.5, 1.1), (1.5, 0.7))
    found = without_waits(one_after_the_other(problem, ("left", "right")), FOREVER)
    assert found.makespan_s == pytest.approx(0.8 / problem.max_velocity["right"].min(), rel=1e-6)
    assert check_plan(found).valid


@pytest.mark.parametrize("first", ["left", "right"])
def test_arms_that_meet_keep_their_order_and_overlap_in_time(first):
    """The right hand crosses the middle, where the left hand goes, and one of them must be first."""
    problem = (
        two_arms.turning((1.2, 0.2), (0.2, -1.2)) if first == "right" else two_arms.turning((0.2, -1.2), (1.2, 0.2))
    )
    second = {"left": "right", "right": "left"}[first]
    plan = one_after_the_other(problem, (first, second))
    assert certify(plan, FOREVER).valid
    found = without_waits(plan, FOREVER)
    longest = max(
        np.ptp(plan.positions[name], axis=0).max() / problem.max_velocity[name][0] for name in (first, second)
    )
    assert longest <= found.makespan_s < 0.95 * plan.makespan_s
    assert begin_of_motion(found, first) == 0.0 < begin_of_motion(found, second)
    assert certify(found, FOREVER).valid


@pytest.mark.parametrize(("ahead", "together"), [(0.58, True), (1.0, False)])
def test_arms_that_would_meet_at_other_times_go_on_moving_together(ahead, together):
    """The left hand follows the right one, and could be twice as fast, because the right wrist turns far."""
    plain = two_arms.turning((-0.8, 0.8 - ahead), (0.8 - ahead, -0.8))
    goal = {"left": plain.goal["left"], "right": plain.goal["right"] + [0, 0, 0, 0, 0, 2 * (1.6 - ahead)]}
    problem = make_problem(plain.cell, plain.start, goal)
    shares = np.linspace(0, 1, 60)[:, None]
    rows = [problem.start[name] + shares * (goal[name] - problem.start[name]) for name in ("left", "right")]
    plan = retime_to_velocity_limits(problem, rows)
    assert certify(plan, FOREVER).valid
    found = without_waits(plan, FOREVER)
    assert certify(found, FOREVER).valid
    done = {
        name: (found.positions[name][:, 0] - problem.start[name][0]) / (goal[name][0] - problem.start[name][0])
        for name in ("left", "right")
    }
    assert (np.interp(0.23, done["right"], done["left"]) == pytest.approx(0.23, abs=1e-3)) == together


class Reference:
    """Wait removal as its definition says, with every test of two steps.

    Attributes:
        units: steps that take place together, lists of (arm, step), in the order of the plan.
        begins, ends: new times [s] of the steps of each arm.
    """

    def __init__(self, plan):
        problem, names = plan.problem, plan.problem.cell.arm_names
        rows = [plan.positions[name] for name in names]
        paths, self.durations, instants, now = [[r[0]] for r in rows], [[] for _ in rows], [[] for _ in rows], 0
        for k in range(len(plan.times) - 1):
            count = math.ceil(max(np.abs(r[k + 1] - r[k]).max() for r in rows) / STEP_RAD)
            for arm, r in enumerate(rows):
                move = r[k + 1] - r[k]
                if not move.any():
                    continue
                for s in range(count):
                    # Rounded as in the core: a last bit decides whether two steps conflict.
                    paths[arm].append(r[k] + move * (s + 1) / count if s + 1 < count else r[k + 1])
                    instants[arm].append(now + s)
                    self.durations[arm].append((np.abs(move) / problem.max_velocity[names[arm]]).max() / count)
            now += count
        core_cell, distance = problem.cell.collision.core, problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof
        motions = [core.Motion(core_cell, arm, np.array(path)) for arm, path in enumerate(paths)]
        found = {
            (a, b): core.swept_conflicts(motions[a], motions[b], distance)
            for a, b in itertools.permutations(range(len(rows)), 2)
        }
        self.conflicts = {(a, b): found[a, b] & found[b, a].T for a, b in found}
        self.instants = instants
        self.units = [unit for instant in range(now) for unit in self.units_at(instant)]
        self.begins, self.ends = ([[math.nan] * len(each) for each in instants] for _ in range(2))
        for unit in self.units:
            self.begin_early(unit)

    def units_at(self, instant):
        units = []
        for arm, steps in enumerate(self.instants):
            if instant in steps:
                step = steps.index(instant)
                met = [unit for unit in units if any(self.conflicts[arm, b][step, of_b] for b, of_b in unit)]
                units = [unit for unit in units if unit not in met] + [[(arm, step), *itertools.chain(*met)]]
        return units

    def begin_early(self, unit):
        instant = self.instants[unit[0][0]][unit[0][1]]
        begin = max((self.ends[arm][step - 1] for arm, step in unit if step > 0), default=0.0)
        for arm, step in unit:
            for b in range(len(self.instants)):
                for t, of_b in enumerate(self.instants[b]):
                    if b != arm and of_b < instant and self.conflicts[arm, b][step, t]:
                        begin = max(begin, self.ends[b][t])
        for arm, step in unit:
            self.begins[arm][step] = begin
            self.ends[arm][step] = begin + max(self.durations[a][s] for a, s in unit)


@pytest.mark.parametrize(("cell", "seed"), [("ring-4", 1), ("ring-4-panda", 0), ("ring-6", 2)])
def test_arms_arrive_as_early_as_the_reference_says(cell, seed):
    problem = draw_problem(find_cell(cell), seed=seed)
    plan = mmp_planners.make("group-rrt", waits="kept").plan(problem, seed=seed, time_limit=120.0).plan
    found, expected = without_waits(plan, FOREVER), Reference(plan)
    assert found.makespan_s == pytest.approx(max(ends[-1] for ends in expected.ends if ends), abs=1e-5)
    for name, ends in zip(problem.cell.arm_names, expected.ends, strict=True):
        path = found.positions[name]
        moving = np.abs(path - path[-1]).max(axis=1) > 1e-9
        assert found.times[np.flatnonzero(moving)[-1] + 1] == pytest.approx(ends[-1], abs=1e-5)


@pytest.mark.parametrize(("cell", "seed"), list(itertools.product(["ring-4", "ring-8-panda", "line-16"], [0, 1])))
def test_paths_stay_and_the_plan_is_proved(cell, seed):
    problem = draw_problem(find_cell(cell), seed=seed)
    plan = mmp_planners.make("group-rrt", waits="kept").plan(problem, seed=seed, time_limit=120.0).plan
    found = without_waits(plan, FOREVER)
    assert found.makespan_s < plan.makespan_s
    assert found.cost_rad == pytest.approx(plan.cost_rad, abs=1e-4)
    for name in problem.cell.arm_names:
        before, after = (along(each.positions[name], np.linspace(0, 1, 997)) for each in (plan, found))
        np.testing.assert_allclose(after, before, atol=1e-4)
    assert check_plan(found).valid


def test_waits_before_the_first_motion_and_of_single_configurations():
    problem = two_arms.nothing_to_do()
    still = {name: problem.start[name][None] for name in problem.cell.arm_names}
    plan = Plan(problem=problem, times=np.array([0.0]), positions=still)
    assert without_waits(plan, FOREVER).makespan_s == pytest.approx(0.0, abs=1e-6)


def test_no_time_removes_nothing():
    plan = one_after_the_other(two_arms.turning((1.5, 1.1), (1.5, 0.7)), ("left", "right"))
    assert without_waits(plan, core.Clock(0.0)) is None


def test_a_run_keeps_its_plan_if_the_one_without_waits_is_not_proved(monkeypatch):
    run = Run.begin("auto", None, two_arms.turning((1.5, 1.1), (1.5, 0.7)), 0, math.inf)
    plan = one_after_the_other(run.problem, ("left", "right"))
    assert run.offer(plan)
    monkeypatch.setattr(run_module, "certify", lambda *_: refusal(0, 1, instant=0.0))
    assert not run.remove_waits()
    assert run.final.plan is plan
    assert run.counts.failed_certificates == 1


def test_a_cheaper_plan_takes_the_place_of_one_without_waits():
    run = Run.begin("auto", None, two_arms.turning((1.5, 1.1), (1.5, 0.7)), 0, math.inf)
    plan = one_after_the_other(run.problem, ("left", "right"))
    longer = [np.insert(plan.positions[name], 2, plan.positions[name][1], axis=0) for name in ("left", "right")]
    longer[0][2] += 0.1
    assert run.offer(retime_to_velocity_limits(run.problem, longer))
    assert run.remove_waits()
    assert run.final.plan.makespan_s < run.best.plan.makespan_s
    assert run.offer(plan)
    assert run.final.plan is plan
