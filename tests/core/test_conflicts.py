"""Conflicts of a whole plan against dense sampling by the reference implementation."""

import dataclasses

import numpy as np
import pytest
from reference import clearance, toys

from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.problems.making import make_problem


def plan_of(cell, waypoints, times):
    """Returns a plan through waypoints, arm name -> [t, dof]."""
    start, goal = ({arm: q[k] for arm, q in waypoints.items()} for k in (0, -1))
    return Plan(problem=make_problem(cell, start, goal), times=np.array(times, dtype=float), positions=waypoints)


def three_arms():
    """Returns a cell in which the tips of stretched arms a and b touch at x = 2. Arm c is far away."""
    return toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi), toys.toy_arm("c", [0, 9, 0])
    )


def passing_twice():
    """Returns a plan in which arm a passes the parked tip of b at 3 s and, faster, moves back at 6 s."""
    still = np.zeros((4, 2))
    return {"a": np.array([[-1.0, 0], [1.0, 0], [1.0, 0], [-1.0, 0]]), "b": still, "c": still}, [0.0, 6.0, 6.5, 7.5]


def touching_times(plan, arm_a, arm_b):
    """Returns (begin, end) [s] of each uninterrupted contact, sampled every 5 ms."""
    cell, times = plan.problem.cell, np.arange(0, plan.times[-1], 0.005)
    states = [plan.at(float(t)) for t in times]
    near = [clearance.moving_clearance(cell, arm_a, s[arm_a], arm_b, s[arm_b]) < plan.problem.margin for s in states]
    changes = np.flatnonzero(np.diff(np.concatenate([[0], near, [0]]).astype(int)))
    return [(times[begin], times[end - 1]) for begin, end in changes.reshape(-1, 2)]


def test_every_time_of_contact_is_one_conflict_with_its_begin_and_end():
    cell = three_arms()
    plan = plan_of(cell, *passing_twice())
    expected = touching_times(plan, "a", "b")
    found = cell.collision.conflicts(plan)
    assert len(expected) == len(found) == 2
    for conflict, (begin, end), speed in zip(found, expected, (2 / 6.0, 2 / 1.0), strict=True):
        resolution = 0.02 / speed + 0.005  # instants between which no joint moves more than 0.02 rad
        assert (conflict.arm_a, conflict.arm_b) == ("a", "b")
        assert conflict.time_s == conflict.start_s
        assert conflict.start_s == pytest.approx(begin, abs=resolution)
        assert conflict.end_s == pytest.approx(end, abs=resolution)


def test_a_conflict_shows_the_deepest_instant_and_its_spheres():
    cell = three_arms()
    plan = plan_of(cell, *passing_twice())
    for conflict in cell.collision.conflicts(plan):
        assert conflict.depth_m == pytest.approx(0.2, abs=2e-3)  # the tips pass through each other
        gap = clearance.moving_clearance(cell, "a", conflict.q_a, "b", conflict.q_b)
        assert conflict.depth_m == pytest.approx(-gap, abs=1e-9)
        at = [cell.collision.spheres(arm, [q]) for arm, q in (("a", conflict.q_a), ("b", conflict.q_b))]
        (p, r_p), (o, r_o) = ((c[0][k], r[k]) for (c, r), k in zip(at, conflict.spheres, strict=True))
        assert np.linalg.norm(p - o) - r_p - r_o == pytest.approx(-conflict.depth_m, abs=1e-9)


def test_conflicts_come_in_the_order_of_time():
    still = np.zeros((3, 2))
    cell = toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0]),
        toys.toy_arm("b", [4, 0, 0], yaw=np.pi),
        toys.toy_arm("c", [0, 4, 0], yaw=-np.pi / 2),
    )
    sweep = np.array([[2.0, 0], [-1.0, 0], [-1.0, 0]])  # past c at a quarter turn, then past b
    waiting = np.array([[0.0, 0], [0.0, 0], [0.0, 0]])
    found = cell.collision.conflicts(plan_of(cell, {"a": sweep, "b": waiting, "c": still}, [0, 6, 7]))
    assert [(c.arm_a, c.arm_b) for c in found] == [("a", "c"), ("a", "b")]
    assert found[0].time_s < found[1].time_s


def test_a_plan_that_keeps_clear_has_no_conflict():
    cell = three_arms()
    aside, still = np.full((2, 2), 0.4), np.zeros((2, 2))
    assert cell.collision.conflicts(plan_of(cell, {"a": aside, "b": still, "c": still}, [0, 1])) == []


def test_a_contact_between_two_times_of_the_plan_is_found():
    cell = three_arms()
    still = np.zeros((2, 2))
    jump = np.array([[-1.5, 0], [1.5, 0]])
    found = cell.collision.conflicts(plan_of(cell, {"a": jump, "b": still, "c": still}, [0, 0.1]))
    assert len(found) == 1
    assert found[0].time_s == pytest.approx(0.05, abs=0.01)


def test_a_plan_that_lacks_an_arm_is_refused():
    cell = three_arms()
    aside, still = np.full((2, 2), 0.4), np.zeros((2, 2))
    plan = plan_of(cell, {"a": aside, "b": still, "c": still}, [0, 1])
    lacking = dataclasses.replace(plan, positions={"a": aside, "c": still})
    with pytest.raises(MmpError, match="does not say where arm 'b' of its cell is"):
        cell.collision.conflicts(lacking)
