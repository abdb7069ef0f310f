"""ModifyMotion pushes a path away from the other arms and keeps its ends, limits, constraints and clearance."""

import math

import numpy as np
import pytest
from reference.repulsion import path_forces
from support import two_arms

from mmp_env import core
from mmp_env.errors import MmpError
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners.apf_ecbs import ApfEcbs
from mmp_planners.conflict_tree.repulsion import (
    Modification,
    NoModification,
    RepulsiveModification,
    ShortenedModification,
)
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

DT_S = 0.1
STEPS, DISTANCES = ("gradient", "normalised"), ("surface", "centre")


def context(problem):
    made = PlanningContext(problem, DT_S, SiRrtStar(), core.Clock(math.inf))
    made.reseed(0)
    return made, [made.low_level(k, (), k)[0] for k in range(len(made.names))]


CONTEXT, PATHS = context(two_arms.passing())
# The left hand passes the parked right arm with a penetration of 2 cm, and with a clearance of 3 cm.
GRAZING = context(two_arms.turning((0.8, -0.8), (0.0, 0.0), distance_m=1.6))
NEAR = context(two_arms.turning((0.8, -0.8), (0.0, 0.0), distance_m=1.65))


def crowded():
    cell = ring_cell(4)
    return context(make_problem(cell, *draw_instance(cell, seed=2)))


def test_a_planner_that_does_not_repel_leaves_paths_as_they_are():
    assert NoModification()(CONTEXT, PATHS, 0, ()) is None
    assert isinstance(NoModification(), Modification)
    assert isinstance(RepulsiveModification(), Modification)


@pytest.mark.parametrize(
    ("step", "where", "arm"),
    [
        ("gradient", GRAZING, 0),
        ("normalised", GRAZING, 0),
        ("normalised", (CONTEXT, PATHS), 0),
        ("normalised", (CONTEXT, PATHS), 1),
    ],
)
def test_repulsion_resolves_a_conflict_of_two_arms(step, where, arm):
    there, paths = where
    assert there.conflicts(paths, [(0, 1)])
    modified = RepulsiveModification(step=step)(there, paths, arm, ())
    paths = [modified.path if k == arm else path for k, path in enumerate(paths)]
    assert there.conflicts(paths, [(0, 1)]) == {}
    assert there.certify(there.plan(paths)).valid


@pytest.mark.parametrize("step", STEPS)
def test_ends_limits_and_freedom_are_kept(step):
    there, paths = crowded()
    moved = 0
    for arm, name in enumerate(there.names):
        modified = RepulsiveModification(step=step)(there, paths, arm, ())
        if modified is None:
            continue
        moved += 1
        q, robot = modified.path.q, there.problem.cell.arm(name).robot
        np.testing.assert_array_equal(q[[0, -1]], paths[arm].q[[0, -1]])
        assert q.shape == paths[arm].q.shape
        assert ((q >= robot.lower) & (q <= robot.upper)).all()
        proved = there.keep_levels().proof
        fine = np.vstack([q[:-1] + f * np.diff(q, axis=0) for f in np.linspace(0, 1, 9)])
        clearance = there.model.static_clearance(name, fine, precise=True)
        assert clearance.min() >= proved - 1e-5
        assert (np.abs(np.diff(q, axis=0)) <= 3 * there.max_step[arm] + 1e-6).all()
        assert modified.path.length == pytest.approx(np.abs(np.diff(q, axis=0)).sum())
    assert moved >= 2


@pytest.mark.parametrize("step", STEPS)
def test_constraints_are_kept(step):
    """The constraint forbids the end of the free descent, so ModifyMotion returns an earlier iterate."""
    there, paths = GRAZING
    free = RepulsiveModification(step=step)(there, paths, 0, ())
    moved = np.abs(free.path.q - paths[0].q).max(axis=1)
    k = int(moved.argmax())
    ball = core.Constraint.ball(free.path.q[k], 0.1 * moved[k], k - 1, k + 1)

    def breaks(path):
        return core.breaks_constraint(there.core, path.motion, [ball], there.problem.margin)

    assert breaks(free.path)
    assert not breaks(paths[0])
    kept = RepulsiveModification(step=step)(there, paths, 0, [ball])
    assert kept is not None
    assert not breaks(kept.path)


@pytest.mark.parametrize(("options", "words"), [({"floor": 0.1}, "'floor'"), ({"stretch": 0.5}, "'stretch'")])
def test_options_with_which_nothing_would_ever_move_are_refused(options, words):
    with pytest.raises(MmpError, match=words):
        ApfEcbs(**options)


def test_far_from_others_nothing_is_moved():
    there, paths = context(two_arms.one_moves())
    assert RepulsiveModification()(there, paths, 0, ()) is None


def test_an_arm_that_stands_still_is_not_moved():
    there, paths = context(two_arms.parked_arm_between())
    assert paths[1].last == 0
    assert RepulsiveModification()(there, paths, 1, ()) is None


def test_a_parked_arm_yields_and_returns_if_asked():
    there, paths = GRAZING
    assert paths[1].last == 0
    assert there.conflicts(paths, [(0, 1)])
    assert RepulsiveModification()(there, paths, 1, ()) is None
    path = RepulsiveModification(parked_yield=True)(there, paths, 1, ()).path
    assert 0 < path.last <= paths[0].last
    np.testing.assert_array_equal(path.q[[0, -1]], paths[1].q[[0, 0]])
    assert (path.q[-2] != path.q[-1]).any()
    assert not there.conflicts([paths[0], path], [(0, 1)])


def moved_by(**options):
    """Returns how far one iteration of the gradient moves a joint [rad]."""
    there, paths = GRAZING
    modified = RepulsiveModification(step="gradient", max_iterations=1, early_stop=False, **options)(
        there, paths, 0, ()
    )
    return 0.0 if modified is None else float(np.abs(modified.path.q - paths[0].q).max())


@pytest.mark.parametrize("distance", DISTANCES)
def test_a_gradient_step_is_alpha_times_the_force(distance):
    """The force is that of the reference implementation, which tests/core compares with its potential."""
    there, paths = GRAZING
    # Centres of arms in contact are still far apart, and the floor of surfaces lets forces exceed the cap.
    alpha, d0 = (1e-8, 0.1) if distance == "surface" else (1e-4, 0.4)
    modified = RepulsiveModification(
        step="gradient", distance=distance, alpha=alpha, d0=d0, max_iterations=1, early_stop=False
    )(there, paths, 0, ())
    by_name = {name: path.q for name, path in zip(there.names, paths, strict=True)}
    force = path_forces(there.problem.cell, there.names[0], by_name, k_rep=0.05, d0=d0, distance=distance)
    step = alpha * force
    assert 1e-5 < np.abs(step).max() < 0.05
    found = modified.path.q - paths[0].q
    np.testing.assert_allclose(found, step, rtol=0, atol=1e-2 * np.abs(step).max())


def test_a_step_that_would_end_the_descent_is_halved_if_asked():
    """Without the cap, the force of alpha = 1 moves the arm farther than neighbouring waypoints may be apart."""
    assert moved_by(alpha=1.0, cap=0.0) == 0.0
    assert moved_by(alpha=1.0, cap=0.0, halvings=5) == 0.0
    assert 0.0 < moved_by(alpha=1.0, cap=0.0, halvings=40) < 1.0


def test_paper_literal_settings_are_options_of_the_planner():
    literal = {"distance": "centre", "step": "gradient", "early_stop": False, "fast_track": "literal"}
    modification = ApfEcbs(**literal, max_iterations=7, alpha=2e-7, k_rep=0.1, d0=0.2, trace=True).modification()
    assert modification == RepulsiveModification(
        distance="centre",
        step="gradient",
        early_stop=False,
        max_iterations=7,
        alpha=2e-7,
        k_rep=0.1,
        d0=0.2,
        trace=True,
    )


def test_a_larger_gain_and_a_longer_reach_push_farther():
    once = moved_by(alpha=1e-8)
    assert moved_by(alpha=2e-8) == pytest.approx(2 * once, rel=1e-2)
    assert moved_by(alpha=1e-8, k_rep=0.1) == pytest.approx(2 * once, rel=1e-2)
    assert moved_by(alpha=1e-8, d0=0.3) > once


@pytest.mark.parametrize("step", STEPS)
def test_repulsion_stops_at_two_centimetres_unless_early_stop_is_off(step):
    there, paths = NEAR
    early, on = (RepulsiveModification(step=step, early_stop=stop)(there, paths, 0, ()) for stop in (True, False))
    assert early.iterations == 1
    assert 1 < on.iterations <= 50

    def clearance(path):
        rows = [np.array([p.at(k / 4) for k in range(4 * 30)]) for p in (path, paths[1])]
        return there.model.pair_clearance("left", rows[0], "right", rows[1]).min()

    assert 0.02 <= clearance(paths[0]) < clearance(early.path) < clearance(on.path)


@pytest.mark.parametrize("step", STEPS)
def test_a_trace_shows_every_iterate_and_changes_nothing(step):
    plain = RepulsiveModification(step=step)(CONTEXT, PATHS, 0, ())
    traced = RepulsiveModification(step=step, trace=True)(CONTEXT, PATHS, 0, ())
    assert plain.iterates == ()
    assert len(traced.iterates) == traced.iterations == plain.iterations
    np.testing.assert_array_equal(traced.path.q, plain.path.q)
    steps = np.diff([PATHS[0].q, *traced.iterates], axis=0)
    assert (np.abs(steps) <= 0.05 + 1e-6).all(), "a joint moves 0.05 rad an iteration at most"
    if step == "normalised":
        assert (np.abs(steps).max(axis=(1, 2)) <= 0.03 + 1e-6).all()
    np.testing.assert_allclose(traced.iterates[-1], traced.path.q, rtol=0, atol=1e-6)


def test_repulsion_ends_with_the_clock():
    there, paths = context(two_arms.passing())
    there.clock.cancel()
    assert RepulsiveModification()(there, paths, 0, ()) is None


def conflict_count(there, paths, arm):
    return sum(map(len, there.conflicts(paths, there.pairs(arm)).values()))


def test_a_shortened_repelled_path_is_shorter_and_has_no_more_conflicts():
    there, paths = crowded()
    shorter = []
    for arm in range(4):
        plain = RepulsiveModification()(there, paths, arm, ())
        short = ShortenedModification(modification=RepulsiveModification())(there, paths, arm, ())
        if plain is None:
            assert short is None
            continue
        replaced = [[*paths[:arm], m.path, *paths[arm + 1 :]] for m in (plain, short)]
        assert conflict_count(there, replaced[1], arm) <= conflict_count(there, replaced[0], arm)
        assert short.path.length <= plain.path.length
        shorter.append(short.path.length < plain.path.length)
    assert any(shorter)


def test_shortening_is_an_option_of_the_planner():
    assert isinstance(ApfEcbs(shorten_paths=True).modification(), ShortenedModification)
    assert isinstance(ApfEcbs().modification(), RepulsiveModification)
