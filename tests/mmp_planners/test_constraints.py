"""Constraints of the branches of a conflict: window, state and ball; the children keep them."""

import math

import numpy as np
import pytest
from reference import intervals
from support import two_arms

from mmp_env import core
from mmp_planners.conflict_tree.constraints import INSTANTS, AvoidState, ConflictInterval, OneSided, Vertex
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

DT_S, SPEED = 0.1, 0.8
FLOAT_RAD = 1e-6  # configurations are single precision in the core


def context(problem):
    made = PlanningContext(problem, DT_S, SiRrtStar(iterations=4000), core.Clock(math.inf))
    made.reseed(0)
    return made


CONTEXT = context(two_arms.passing())
PATHS = [CONTEXT.low_level(k, (), 0)[0] for k in (0, 1)]
INTERVAL = ConflictInterval(a=0, b=1, first=9.0, last=11.0)


def windows(constraints):
    return [(constraint.start, constraint.end) for constraint in constraints]


def test_both_kinds_are_constraint_kinds_and_say_in_words_what_they_forbid():
    for kind in (AvoidState(), Vertex()):
        assert isinstance(kind, OneSided)
    assert AvoidState().describe(CONTEXT, INTERVAL, 0) == "left avoids right at 0.9 s"
    assert AvoidState().describe(CONTEXT, INTERVAL, 1) == "right avoids left at 0.9 s"
    assert Vertex().describe(CONTEXT, INTERVAL, 1) == "right leaves its configuration at 0.9 s"


@pytest.mark.parametrize(("pad", "pad_factor"), [(0.1, 1.0), (0.3, 1.0), (0.5, 1.0), (0.2, 2.5)])
@pytest.mark.parametrize(("first", "last"), [(9.0, 11.0), (9.0, 9.0), (9.5, 9.5), (8.5, 11.0)])
def test_a_state_is_avoided_from_pad_before_the_conflict_to_pad_after_it(pad, pad_factor, first, last):
    """The conflict may begin up to a step before its first instant, and end up to a step after its last."""
    interval = ConflictInterval(a=0, b=1, first=first, last=last, pad_factor=pad_factor)
    ((start, end),) = windows(AvoidState(pad=pad).forbid(CONTEXT, PATHS, interval, 0, "begin"))
    steps = pad_factor * pad / DT_S
    assert first - steps - 1 <= start <= first - steps + 1e-9
    assert last + steps + 1 - 1e-9 <= end <= last + steps + 2


@pytest.mark.parametrize("instant", INSTANTS)
@pytest.mark.parametrize("kind", [AvoidState(), Vertex()])
def test_there_is_one_constraint_for_each_instant_of_the_conflict(kind, instant):
    constraints = kind.forbid(CONTEXT, PATHS, INTERVAL, 1, instant)
    assert len(constraints) == len(INTERVAL.instants(instant))


def test_a_window_does_not_begin_before_the_motion():
    early = ConflictInterval(a=0, b=1, first=1.0, last=2.0)
    ((start, _),) = windows(AvoidState(pad=0.5).forbid(CONTEXT, PATHS, early, 0, "begin"))
    assert start == 0
    ((start, end),) = windows(
        Vertex().forbid(CONTEXT, PATHS, ConflictInterval(a=0, b=1, first=0.5, last=0.5), 0, "begin")
    )
    assert (start, end) == (0, 1)


def test_an_arm_that_is_parked_stays_there_and_so_does_the_constraint():
    last = PATHS[1].last
    for at, end in ((last - 1.0, last + 3), (float(last), core.FOREVER), (last + 5.0, core.FOREVER)):
        interval = ConflictInterval(a=0, b=1, first=at, last=at)
        (constraint,) = AvoidState(pad=0.3).forbid(CONTEXT, PATHS, interval, 0, "begin")
        assert constraint.end == (end if end == core.FOREVER else int(at) + 1 + 3)


def test_where_the_start_touches_the_state_the_window_opens_with_the_conflict():
    """The right arm later reaches the start of the left arm. Until then the left arm may stay."""
    problem = two_arms.turning((0.0, 1.0), (1.0, -1.0))
    there = context(problem)
    paths = [there.low_level(k, (), 0)[0] for k in (0, 1)]
    at_middle = int(np.argmin(np.abs(paths[1].q[:, 0] - two_arms.reaching(0.0)[0])))
    assert there.start_touches(0, 1, paths[1].at(at_middle))
    interval = ConflictInterval(a=0, b=1, first=float(at_middle), last=at_middle + 1.0)
    (constraint,) = AvoidState(pad=0.3).forbid(there, paths, interval, 0, "begin")
    assert (constraint.start, constraint.end) == (at_middle, at_middle + 5)
    assert there.low_level(0, [constraint], 0)[0] is not None
    (other,) = AvoidState(pad=0.3).forbid(there, paths, interval, 1, "begin")
    assert other.start == at_middle - 3


def stays_in_ball(centre, radius, constraint):
    """Returns whether an arm `radius` from `centre` breaks the constraint in the middle of the window."""
    last = constraint.end + 1
    for joint in range(6):
        q = np.repeat(centre[None], last + 1, axis=0)
        q[:, joint] += radius
        motion = CONTEXT.model.motion("left", q)
        if not core.breaks_constraint(CONTEXT.core, motion, [constraint], 0.001):
            return False
    return True


@pytest.mark.parametrize(("k", "radius"), [(1, 0.04), (2, 0.08), (4, 0.16), (5, 0.2), (9, 0.2)])
def test_the_ball_of_a_vertex_shrinks_towards_the_start_so_that_it_can_be_left(k, radius):
    """r = min(0.2 rad, v_max t / 2) with v_max 0.8 rad/s, so the start is outside the ball at any time."""
    interval = ConflictInterval(a=0, b=1, first=float(k), last=float(k))
    (constraint,) = Vertex().forbid(CONTEXT, PATHS, interval, 0, "begin")
    assert (constraint.start, constraint.end) == (k - 1, k + 1)
    centre = PATHS[0].at(float(k))
    assert stays_in_ball(centre, radius - 1e-4, constraint)
    assert not stays_in_ball(centre, radius + 1e-4, constraint)
    path, _ = CONTEXT.low_level(0, [constraint], 1)
    assert path is not None
    reference = intervals.BallConstraint(centre, radius - FLOAT_RAD, k - 1, k + 1)
    assert not intervals.is_path_breaking(CONTEXT.problem.cell, "left", path.q, reference, per_step=20)
    assert intervals.is_path_breaking(CONTEXT.problem.cell, "left", PATHS[0].q, reference, per_step=20)


def test_the_ball_of_a_vertex_follows_the_option():
    (constraint,) = Vertex(radius=0.05).forbid(CONTEXT, PATHS, INTERVAL, 0, "begin")
    assert stays_in_ball(PATHS[0].at(9.0), 0.0499, constraint)
    assert not stays_in_ball(PATHS[0].at(9.0), 0.0501, constraint)


def clearance_in_window(path, arm, other, q, start, end, per_step=10):
    """Returns the least clearance [m] of a path from the other arm at q, at instants within the window."""
    steps = np.arange(start * per_step + 1, min(end, path.last + 2) * per_step) / per_step
    rows = np.array([path.at(float(t)) for t in steps])
    names = CONTEXT.names
    still = np.repeat(q[None], len(rows), axis=0)
    return CONTEXT.problem.cell.collision.pair_clearance(names[arm], rows, names[other], still).min()


@pytest.mark.parametrize("instant", INSTANTS)
@pytest.mark.parametrize("arm", [0, 1])
def test_a_child_does_not_touch_the_other_arm_as_it_stood(arm, instant):
    """The test samples ten instants per step. Without the constraint the arms touch."""
    other = 1 - arm
    first, last = (float(k) for k in CONTEXT.conflicts(PATHS, CONTEXT.pairs())[0, 1][[0, -1]])
    interval = ConflictInterval(a=0, b=1, first=first, last=last)
    constraints = AvoidState().forbid(CONTEXT, PATHS, interval, arm, instant)
    path, _ = CONTEXT.low_level(arm, constraints, 2)
    assert path is not None
    for k, constraint in zip(interval.instants(instant), constraints, strict=True):
        around = other, PATHS[other].at(k), constraint.start, constraint.end
        assert clearance_in_window(path, arm, *around) > CONTEXT.problem.margin
        assert clearance_in_window(PATHS[arm], arm, *around) < 0


def test_constraints_of_several_kinds_are_kept_together():
    both = [
        *AvoidState().forbid(CONTEXT, PATHS, INTERVAL, 0, "all"),
        *Vertex().forbid(CONTEXT, PATHS, INTERVAL, 0, "begin"),
    ]
    path, _ = CONTEXT.low_level(0, both, 3)
    assert path is not None
    assert not core.breaks_constraint(CONTEXT.core, path.motion, both, CONTEXT.problem.margin)
    assert core.breaks_constraint(CONTEXT.core, PATHS[0].motion, both, CONTEXT.problem.margin)
