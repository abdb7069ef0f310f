"""`split` loses nothing: two configurations that are free of contact satisfy one of its two branches."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reference.clearance import Cloud, cloud, least_gap
from support import two_arms
from support.first_conflicts import CASES, conflict

from mmp_env import core
from mmp_planners.arm_bounds import lipschitz
from mmp_planners.conflict_tree.constraints import Split
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval
from mmp_planners.conflict_tree.constraints.split import deepest
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

every_case = pytest.mark.parametrize("case", CASES)
FLOAT_M = 1e-5


def split(case, **options):
    """Returns the ball of arm j, the core that arm i must avoid, and the numbers behind both."""
    context, paths, interval = conflict(case)
    out, off = Split(**options).branches(context, paths, interval, "begin")
    contact = deepest(context, paths, interval)
    bound = lipschitz(context.problem.cell.arms[out.arm], context.problem.cell.spheres)
    radius = Split(**options).share * (context.conflict_distance - contact.gap) / bound
    return context, paths, out, off, contact, bound, radius


def moving(context, arm, q):
    return cloud(context.problem.cell, context.problem.cell.arms[arm], q).moving


def smaller(spheres, by):
    return Cloud(spheres.parts, spheres.centers, spheres.radii - by)


def is_broken(context, arm, q, constraint):
    """Returns whether an arm that stays at q breaks a constraint."""
    motion = context.model.motion(context.names[arm], q[None])
    return core.breaks_constraint(context.core, motion, [constraint], context.conflict_distance)


@every_case
def test_both_branches_are_of_the_one_deepest_instant(case):
    context, paths, out, off, contact, _, _ = split(case)
    (ball,), (core,) = out.constraints, off.constraints
    assert ball.start == ball.end == core.start == core.end == contact.instant
    interval = conflict(case)[2]
    assert {out.arm, off.arm} == {interval.a, interval.b}
    for k in np.arange(np.ceil(interval.first), interval.last + 1):
        gap = least_gap(
            moving(context, interval.a, paths[interval.a].at(k)), moving(context, interval.b, paths[interval.b].at(k))
        )
        assert gap >= contact.gap - 1e-9


@every_case
def test_the_ball_is_as_large_as_the_depth_allows_and_the_core_still_in_contact(case):
    context, paths, out, off, contact, bound, radius = split(case)
    q_j, q_i = (paths[arm].at(contact.instant) for arm in (out.arm, off.arm))
    assert 0 < radius * bound < context.conflict_distance - contact.gap
    core = smaller(moving(context, out.arm, q_j), radius * bound)
    assert least_gap(moving(context, off.arm, q_i), core) < context.conflict_distance
    assert is_broken(context, off.arm, q_i, off.constraints[0])
    assert is_broken(context, out.arm, q_j, out.constraints[0])
    assert is_broken(context, out.arm, q_j + 0.99 * radius, out.constraints[0])
    assert not is_broken(context, out.arm, q_j + 1.02 * radius, out.constraints[0])


def signs(dof):
    return st.lists(st.floats(-1, 1) | st.sampled_from([-1.0, 1.0]), min_size=dof, max_size=dof).map(np.array)


@given(case=st.sampled_from(sorted(CASES)), where=signs(6), away=signs(6), share=st.sampled_from([0.3, 0.5, 0.9]))
def test_no_pair_of_configurations_with_the_margin_is_lost(case, where, away, share):
    """Arm j is anywhere in its ball, and arm i just has the margin. Then arm i must be clear of the core.

    Bisection finds the hardest configurations: those with the margin and hardly more.
    """
    context, paths, out, off, contact, bound, radius = split(case, share=share)
    q_j, q_i = paths[out.arm].at(contact.instant) + radius * where, paths[off.arm].at(contact.instant)
    there = moving(context, out.arm, q_j)

    def clear(s):
        return least_gap(moving(context, off.arm, q_i + s * away), there) >= context.conflict_distance + FLOAT_M

    assume(clear(1.0))
    low, high = 0.0, 1.0
    for _ in range(25):
        middle = (low + high) / 2
        low, high = (low, middle) if clear(middle) else (middle, high)
    free = q_i + high * away
    core = smaller(moving(context, out.arm, paths[out.arm].at(contact.instant)), radius * bound)
    assert least_gap(moving(context, off.arm, free), core) >= context.conflict_distance
    assert not is_broken(context, off.arm, free, off.constraints[0])


def test_without_the_shrinking_such_pairs_would_be_lost():
    """The test above is sharp: with the whole arm in place of its core, some configurations would be forbidden."""
    context, paths, out, off, contact, _, radius = split("passing")
    q_j, q_i = paths[out.arm].at(contact.instant), paths[off.arm].at(contact.instant)
    lost = 0
    for pan in (-1.0, 1.0):
        moved = q_j + radius * pan * np.eye(6)[0]
        for s in np.linspace(0, 0.6, 2000):
            free = q_i + s * np.eye(6)[0]
            if least_gap(moving(context, off.arm, free), moving(context, out.arm, moved)) >= context.conflict_distance:
                lost += (
                    least_gap(moving(context, off.arm, free), moving(context, out.arm, q_j)) < context.conflict_distance
                )
                break
    assert lost > 0


def test_the_second_of_two_equal_arms_gets_the_ball():
    _, _, out, off, *_ = split("in the ring")
    assert out.arm > off.arm


def barely(depth):
    """Returns two hands in conflict at one instant, at most `depth` [m] closer than the margin."""
    problem = two_arms.passing()
    context = PlanningContext(problem, 0.1, SiRrtStar(), core.Clock(math.inf))
    interval = ConflictInterval(a=0, b=1, first=1.0, last=1.0)

    def paths(pan):
        via = {"left": two_arms.reaching(pan), "right": two_arms.reaching(0.0)}
        rows = [np.vstack([problem.start[name], via[name], problem.goal[name]]) for name in context.names]
        return [context.path(arm, q) for arm, q in enumerate(rows)]

    near, far = 0.0, 0.8
    for _ in range(60):
        pan = (near + far) / 2
        deep = deepest(context, paths(pan), interval).gap < context.conflict_distance - depth
        near, far = (pan, far) if deep else (near, pan)
    return context, paths(near), interval


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("depth", [1e-3, 1e-4, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 1e-7])
def test_each_branch_of_a_shallow_conflict_forbids_its_side(depth, share):
    context, paths, interval = barely(depth)
    contact = deepest(context, paths, interval)
    assert contact.gap == pytest.approx(context.conflict_distance - depth, abs=1e-9)
    for branch in Split(share=share).branches(context, paths, interval, "begin"):
        q = paths[branch.arm].at(contact.instant)
        assert is_broken(context, branch.arm, q, branch.constraints[0]), branch.description
